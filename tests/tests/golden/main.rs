//! Golden recordings: what comes out of a stream for what goes in, frozen by digests in `tests/golden`.
//!
//! Every recording drives a stream through a scenario and compares each corrected tick and everything that the stream can
//! be asked with what is committed. `ISOTHERM_BLESS=1` writes the files anew: only where a change of the output is meant.

#![expect(clippy::unwrap_used, clippy::panic, reason = "what does not hold ends the test")]

mod file;
mod look;
mod plain;
mod recording;
mod scenarios {
    pub(crate) mod accels;
    pub(crate) mod documents;
    pub(crate) mod drift;
    pub(crate) mod edges;
    pub(crate) mod modes;
    pub(crate) mod outputs;
    pub(crate) mod producer;
    pub(crate) mod sensors;
    pub(crate) mod states;
    pub(crate) mod swaps;
    pub(crate) mod temperatures;
}
/// The lives that are written down and read back elsewhere (I2).
mod rich {
    pub(crate) use isotherm_tests::lives::{
        drift as life_of_drift_from_references_and_at_rest, excluded as life_of_six_gyros_of_which_one_fails,
        mode_reversal as life_of_mode_reversal_with_mishaps, navigation as life_of_navigation_steps,
        states as life_of_self_tests_and_pre_launch_calibrations,
        swaps as life_of_slews_and_changes_that_wait, uncalibrated as life_held_without_a_calibration,
    };
}
mod service;

use std::collections::BTreeSet;

/// One test for each recording; its name is that of its file.
macro_rules! recordings {
    ($($record:path: $($scenarios:ident)::+ { $($name:ident)+ })+) => {
        /// Every one, by its name.
        const NAMES: &[&str] = &[$($(stringify!($name),)+)+];

        $(recordings!(@each $record, [$($scenarios)::+] $($name)+);)+
    };
    (@each $record:path, $scenarios:tt $($name:ident)+) => {
        $(recordings!(@one $record, $scenarios $name);)+
    };
    (@one $record:path, [$($scenarios:ident)::+] $name:ident) => {
        #[test]
        fn $name() {
            file::check(stringify!($name), &$record(&$($scenarios)::+::$name()));
        }
    };
}

recordings! {
    recording::record: scenarios::documents {
        document_zlg_0001_at_rest
        document_zlg_0001_swinging
        document_fog_0001
        document_mems_0001
        document_mems_0001_uneven_ticks
        preset_skewed_six_of_which_one_fails
        document_example_full
        document_chamber_mems
        document_rlg_static
    }
    recording::record: scenarios::modes {
        mode_switches_alone
        mode_switches_in_gaps
        mode_switches_few_ticks_apart
        mode_switches_by_other_fits
        mode_switches_of_a_stated_time
        servo_with_half_period_counts
        servo_without_half_period_counts
        servo_of_a_dither_that_turns_with_the_mode
        slow_meander_and_trend
    }
    recording::record: scenarios::sensors {
        parity_of_six
        parity_of_eight_until_two_are_left
        eight_sensors_of_which_six_read_no_number
        parity_of_four_over_mode_switches
        rails_of_counting_sensors
        rails_of_mean_sensors
        readings_that_are_no_numbers
    }
    recording::record: scenarios::temperatures {
        temperatures_missing_and_stale
        temperatures_at_the_edge_of_stale
        temperature_spikes
        temperatures_unknown_late_and_out_of_order
        temperatures_too_many
        thermal_branches_and_lags
        temperatures_outside_the_fitted_range
    }
    recording::record: scenarios::producer {
        producer_restarts
        producer_of_before_takes_over_again
        sequence_numbers_reset
        clock_steps
        gaps_short_and_long
        ticks_doubled_late_and_swapped
        bad_durations
        wrong_sensors_and_wrong_outputs
        ticks_that_wait_too_many
        flushed_tails
        messages_of_other_lengths
        unit_without_accelerometers
    }
    recording::record: scenarios::accels {
        accelerometers_some_missing
        accelerometers_all_missing
        accelerometers_behind_and_late
        accelerometers_beside_their_gyro_ticks
        outputs_counts_and_counts
        outputs_counts_and_means
        outputs_means_and_counts
        outputs_means_and_means
    }
    recording::record: scenarios::swaps {
        swaps_at_once_at_a_sequence_and_at_a_time
        swaps_slewed
        swaps_with_other_terms_and_channels
        swaps_to_another_number_of_sensors
        swaps_to_the_same_document
        swaps_in_the_middle_of_a_mode_transition
        swaps_replaced_before_their_time
        swaps_and_the_drift
    }
    recording::record: scenarios::states {
        self_tests
        commands_refused_and_taken
        standby_and_run
        pre_launch_calibrations
        pre_launch_calibration_without_modes
        rest_and_moves
        drift_references_good_and_bad
        drift_estimated_and_not_subtracted
    }
    recording::record: scenarios::outputs {
        navigation_steps_with_coning_and_sculling
        navigation_steps_of_large_turns
        navigation_steps_as_plain_sums
        navigation_steps_of_one_tick_with_coning_and_sculling
        navigation_steps_of_skewed_sensors
        uncalibrated_passed_through
        uncalibrated_held
        uncalibrated_in_navigation_steps
        times_from_zero_on
        times_before_zero
        times_near_the_last_one
        times_near_the_first_one
        times_about_half_of_the_last_one
        times_from_one_end_to_the_other
    }
    recording::record: scenarios::drift {
        drift_references_not_believed_at_first
        drift_references_out_of_reach
        drift_at_rest_that_is_nudged
    }
    recording::record: scenarios::edges {
        edge_of_an_orientation_s_range
        edge_of_a_branch_s_range
        edge_of_the_board_s_freshness
        edge_of_a_line_s_end
        edge_of_a_plausible_step
        edge_of_what_is_late
        edge_of_a_restart
        edge_of_modes_as_they_are
        edge_of_a_switch_s_reach
        edge_of_other_fits_in_a_transition
        edge_of_a_suspicion
        edge_of_a_median
        edge_of_a_self_test
        edge_of_a_servo_at_a_restart
        edge_of_the_last_good_rate
        edge_of_other_outputs
        edge_of_a_calibration_that_comes_late
    }
    recording::record: rich {
        life_of_mode_reversal_with_mishaps
        life_of_six_gyros_of_which_one_fails
        life_of_navigation_steps
        life_of_self_tests_and_pre_launch_calibrations
        life_of_drift_from_references_and_at_rest
        life_of_slews_and_changes_that_wait
        life_held_without_a_calibration
    }
    recording::record: service {
        stream_that_follows_a_journal
    }
    service::record: service {
        service_and_its_journal
    }
}

#[test]
fn every_committed_file_is_of_a_recording() {
    let names: BTreeSet<_> = NAMES.iter().map(|name| format!("{name}.txt")).collect();
    assert_eq!(names.len(), NAMES.len(), "no two recordings have one name");
    let mut bytes = 0;
    for entry in std::fs::read_dir(file::folder()).unwrap() {
        let entry = entry.unwrap();
        let name = entry.file_name().into_string().unwrap();
        if names.contains(&name) {
            bytes += entry.metadata().unwrap().len();
        } else if file::blessing() {
            std::fs::remove_file(entry.path()).unwrap();
        } else {
            panic!("golden/{name} is of no recording: ISOTHERM_BLESS=1 removes it");
        }
    }
    assert!(bytes < LARGEST, "{bytes} bytes of digests, at most {LARGEST} are to be committed");
}

/// Most bytes of all files.
const LARGEST: u64 = 400_000;
