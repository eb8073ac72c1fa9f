//! Settings as their keys state them.

use std::marker::PhantomData;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;

use isotherm_bus::endpoint::address;
use isotherm_correction::units::{AngularRate, Span, SpecificForce};
use isotherm_document::tidy;
use schemars::JsonSchema;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use zenoh::qos::CongestionControl;

/// Seconds of a day.
const DAY_S: u64 = 86_400;

/// The form of a setting in a file.
pub(super) trait Form<T> {
    /// What is written.
    type Written: Serialize + DeserializeOwned;
    fn write(setting: &T) -> Self::Written;
    fn read(written: Self::Written) -> T;
}

/// For `#[serde(with = …)]`: a setting in one of the forms.
pub(super) struct As<F>(PhantomData<F>);

impl<F> As<F> {
    pub(super) fn serialize<T, S: Serializer>(setting: &T, serializer: S) -> Result<S::Ok, S::Error>
    where
        F: Form<T>,
    {
        F::write(setting).serialize(serializer)
    }

    pub(super) fn deserialize<'de, T, D: Deserializer<'de>>(deserializer: D) -> Result<T, D::Error>
    where
        F: Form<T>,
    {
        F::Written::deserialize(deserializer).map(F::read)
    }
}

/// Whole milliseconds.
pub(super) struct Ms;
/// Seconds.
pub(super) struct Seconds;
/// Days, 0 for none.
pub(super) struct Days;
/// °/h.
pub(super) struct DegPerH;
/// °/h, 0 for none.
pub(super) struct SomeDegPerH;
/// Thousandths of standard gravity, 0 for none.
pub(super) struct SomeMilliG;
/// A path, as far as it is text.
pub(super) struct PathText;
/// Text of an address and a port.
pub(super) struct AddressText;
/// Endpoints of Zenoh, without what may be secret when they are written.
pub(super) struct Endpoints;
/// One of them, or none.
pub(super) struct OneEndpoint;

/// One form: type of the setting, what is written, and the way there and back.
macro_rules! form {
    ($form:ty, $setting:ty => $written:ty, |$set:ident| $write:expr, |$given:ident| $read:expr) => {
        impl Form<$setting> for $form {
            type Written = $written;
            fn write($set: &$setting) -> $written {
                $write
            }
            fn read($given: $written) -> $setting {
                $read
            }
        }
    };
}
pub(super) use form;

form!(Ms, Duration => u32, |set| u32::try_from(set.as_millis()).unwrap_or(u32::MAX), |ms| Duration::from_millis(ms.into()));
form!(Ms, Option<Duration> => Option<u32>, |set| set.as_ref().map(Self::write), |ms| ms.map(Self::read));
form!(Ms, Span => u32, |set| u32::try_from(set.as_ns() / 1_000_000).unwrap_or_default(), |ms| Span::from_ms(ms));
form!(Seconds, Duration => f64, |set| set.as_secs_f64(), |s| Duration::from_secs_f64(s));
form!(Seconds, Span => f64, |set| tidy(set.as_s()), |s| Span::from_s(s));
form!(Days, Option<Duration> => u64, |set| set.map_or(0, |age| age.as_secs() / DAY_S),
    |days| (days > 0).then(|| Duration::from_secs(days * DAY_S)));
form!(DegPerH, f64 => f64, |set| tidy(AngularRate::from_rad_per_s(*set).as_deg_per_h()),
    |rate| AngularRate::from_deg_per_h(rate).as_rad_per_s());
form!(SomeDegPerH, Option<f64> => f64, |set| set.as_ref().map_or(0.0, DegPerH::write),
    |rate| (rate > 0.0).then(|| DegPerH::read(rate)));
form!(SomeMilliG, Option<f64> => f64, |set| set.map_or(0.0, |force| tidy(SpecificForce::from_m_per_s2(force).as_g() * 1e3)),
    |force| (force > 0.0).then(|| SpecificForce::from_g(force * 1e-3).as_m_per_s2()));
form!(PathText, Option<PathBuf> => Option<String>, |set| set.as_ref().map(|path| path.display().to_string()),
    |text| text.map(PathBuf::from));
form!(AddressText, Option<SocketAddr> => Option<String>, |set| set.map(|address| address.to_string()),
    |text| text?.parse().ok());
form!(Endpoints, Vec<String> => Vec<String>, |set| set.iter().map(|endpoint| address(endpoint).to_owned()).collect(),
    |endpoints| endpoints);
form!(OneEndpoint, Option<String> => Option<String>, |set| set.as_deref().map(|endpoint| address(endpoint).to_owned()),
    |endpoint| endpoint);

/// State that a unit starts in.
#[derive(Clone, Copy, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(inline)]
pub(super) enum InitialState {
    Running,
    Standby,
}

form!(InitialState, bool => Self, |set| if *set { Self::Standby } else { Self::Running },
    |state| matches!(state, Self::Standby));

/// What is done with the drift estimate.
#[derive(Clone, Copy, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(inline)]
pub(super) enum DriftEstimate {
    Publish,
    Subtract,
}

form!(DriftEstimate, bool => Self, |set| if *set { Self::Subtract } else { Self::Publish },
    |estimate| matches!(estimate, Self::Subtract));

/// What happens to corrected batches where a subscriber does not keep up.
#[derive(Clone, Copy, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(inline)]
pub(super) enum Congestion {
    Drop,
    Block,
}

form!(Congestion, CongestionControl => Self,
    |set| if *set == CongestionControl::Block { Self::Block } else { Self::Drop },
    |way| match way { Self::Drop => CongestionControl::Drop, Self::Block => CongestionControl::Block });
