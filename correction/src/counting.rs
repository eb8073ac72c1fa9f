//! Sets of counters that are read by their names.

/// Declares a set of counters that only ever grow; each gives its name beside its value.
macro_rules! counters {
    ($(#[$doc:meta])* $set:ident { $($(#[$counted:meta])* $name:ident,)+ }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
        pub struct $set {
            $($(#[$counted])* pub $name: u64,)+
        }

        impl $set {
            /// Name and value of every counter, in the order of their declaration.
            pub fn iter(&self) -> impl Iterator<Item = (&'static str, u64)> {
                [$((stringify!($name), self.$name),)+].into_iter()
            }
        }
    };
}

pub(crate) use counters;
