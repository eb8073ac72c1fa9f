// Messages as JSON: numbers that are not finite are null, digests are hexadecimal digits. JSON.parse rounds whole numbers
// beyond 2^53.
// Generated from protocol/layout.toml; change that file, not this one.

export const tickFlags = {
  /** angle predicted over a mode switch */
  INTERPOLATED: 1,
  /** `missed` ticks precede: bridge them */
  GAP: 2,
  /** no accelerometer tick: velocity is zero, in a step partial: bridge it */
  ACCELEROMETER_MISSING: 4,
  /** temperature rates have not settled */
  WARM_UP: 8,
  /** the first three raw readings */
  UNCALIBRATED: 16,
  /** includes angle of an earlier mode switch: take no rate from it */
  ANGLE_RESTORED: 32,
  /** a mode switch could not be restored */
  SWITCH_UNRESOLVED: 64,
  /** coning and sculling are included */
  CONING_SCULLING: 128,
  /** sequence or time restarted */
  RESTART: 256,
  /** a redundant sensor is failing */
  PARITY_EXCEEDED: 512,
  /** do not use: usable gyros do not span three axes, or uncalibrated */
  ANGLE_INVALID: 1024,
  /** likewise, of accelerometers; or their tick lasts a quarter longer or shorter */
  VELOCITY_INVALID: 2048,
  /** servo transient subtracted */
  SERVO_TRANSIENT: 4096,
  /** servo transient without usable half-period counts */
  SERVO_UNMEASURED: 8192,
  /** none is missing, but the last end and this start are half a tick apart */
  TIME_STEP: 16384,
} as const;

export const sensorFlags = {
  /** used as read */
  VALID: 1,
  /** at or beyond the input limit */
  OVERRANGE: 2,
  /** outside the fitted range of a term or the orientation */
  CLAMPED_TEMPERATURE: 4,
  /** temperature missing, rejected or too old */
  STALE_TEMPERATURE: 8,
  /** the last valid value stands in */
  NOT_FINITE: 16,
  /** excluded by the parity check */
  EXCLUDED: 32,
  /** outside the range of the weight over rate */
  CLAMPED_RATE: 64,
} as const;

export interface GyroBatch {
  /** tick i has number first_sequence + i */
  first_sequence: number;
  /** producer's run, e.g. its start time; 0 if unused */
  series: number;
  /** readings of one variant and number */
  ticks: Array<GyroTick>;
}

export interface GyroTick {
  end_time_ns: number;
  /** 1…10¹⁰, measured, not nominal */
  duration_ns: number;
  /** one per gyro, in the document's order */
  readings: Readings;
  /** lasing mode commanded at its end */
  mode: Mode | null;
  /** mode switch commanded at its start */
  switch_command: boolean;
  /** phase of the slow meander, if reported */
  meander: Mode | null;
  /** none, or one per gyro; for the servo transient */
  half_periods: Array<HalfPeriod>;
}

export type Readings = { "Counts": Array<number> } | { "Means": Array<number | null> };

export type Mode = "Plus" | "Minus";

export interface HalfPeriod {
  /** signed counts of the tick's first half and of its second, in order of time */
  positive: number;
  /** signed counts of the tick's first half and of its second, in order of time */
  negative: number;
}

export interface AccelerometerBatch {
  /** independent of the gyros */
  first_sequence: number;
  ticks: Array<AccelerometerTick>;
}

export interface AccelerometerTick {
  /** within half a duration of its gyro tick's */
  end_time_ns: number;
  /** 1…10¹⁰ */
  duration_ns: number;
  readings: Readings;
}

export interface TemperatureBatch {
  /** as in the document */
  channels: Array<string>;
  ticks: Array<TemperatureTick>;
}

export interface TemperatureTick {
  time_ns: number;
  /** one per channel, in V, counts or °C; NaN if absent */
  raw: Array<number | null>;
}

export interface HealthBatch {
  ticks: Array<HealthTick>;
}

export interface HealthTick {
  time_ns: number;
  /** as in [self_test]: volts or a count; NaN if absent */
  readings: Array<HealthReading>;
}

export interface HealthReading {
  name: string;
  value: number | null;
}

export interface RateReference {
  /** 1…120 s, not overlapping the previous, at most two minutes old */
  start_ns: number;
  /** 1…120 s, not overlapping the previous, at most two minutes old */
  end_ns: number;
  /** finite, inertial, about case x, y, z */
  angular_rate_rad_per_s: Array<number | null>;
  /** ≥ 0, finite; standard error per axis, independent */
  sigma_rad_per_s: number | null;
}

export interface CorrectedBatch {
  unit: string;
  revision: Revision;
  temperatures: Array<AppliedTemperature>;
  ticks: Array<CorrectedTick>;
}

export interface CorrectedBatch2 {
  unit: string;
  revision: Revision;
  temperatures: Array<AppliedTemperature>;
  ticks: Array<CorrectedTick>;
  sigmas: Array<Sigma>;
}

export interface CorrectedBatch3 {
  unit: string;
  /** of the gyro batches that it is made of */
  series: number;
  /** calibration of every tick of the batch */
  revision: Revision;
  /** smoothed, at the end */
  temperatures: Array<AppliedTemperature>;
  ticks: Array<CorrectedTick>;
  /** each from its tick up to the next one's; or none */
  sigmas: Array<Sigma>;
}

export interface Sigma {
  /** index of its first tick in the batch */
  from_tick: number;
  angle_noise_rad: Array<number | null>;
  angle_restoration_rad: Array<number | null>;
  angle_calibration_rad: Array<number | null>;
  angle_clamping_rad: Array<number | null>;
  velocity_noise_m_per_s: Array<number | null>;
  velocity_restoration_m_per_s: Array<number | null>;
  velocity_calibration_m_per_s: Array<number | null>;
  velocity_clamping_m_per_s: Array<number | null>;
}

export interface AppliedTemperature {
  channel: string;
  temperature_deg_c: number | null;
  rate_deg_c_per_s: number | null;
}

export interface Revision {
  /** calibrations given to the unit so far; 0 is none */
  counter: number;
  /** first bytes of the document's SHA-256 */
  digest: string;
}

export interface CorrectedTick {
  /** of the (last) raw gyro tick */
  sequence: number;
  end_time_ns: number;
  /** measured; the sum in a step */
  duration_ns: number;
  /** 1…1000 raw ticks */
  ticks: number;
  /** raw gyro ticks missing before this output */
  missed: number;
  /** angle increments about case x, y, z */
  delta_angle_rad: Array<number | null>;
  /** integrated specific force along case x, y, z */
  delta_velocity_m_per_s: Array<number | null>;
  /** at the end */
  mode: Mode | null;
  /** tick flags; in a step those of any tick */
  flags: number;
  /** sensor flags; in a step VALID of all ticks, others of any */
  gyro_flags: Array<number>;
  /** likewise */
  accel_flags: Array<number>;
  /** parity residuals */
  gyro_parity_rad_per_s: Array<number | null>;
  accel_parity_m_per_s2: Array<number | null>;
}

export interface Status {
  unit: string;
  /** of the service */
  instance: string;
  /** of the service */
  version: string;
  state: State;
  /** the last two without a calibration */
  output: Output;
  calibration: ActiveCalibration | null;
  pending: PendingChange | null;
  swaps: Swaps;
  last_tick: LastTick | null;
  channels: Array<ChannelStatus>;
  /** gyros first */
  sensors: Array<SensorStatus>;
  input_rates: InputRates;
  /** present correction */
  applied: AppliedCorrection | null;
  drift: Array<DriftStatus>;
  /** after the command rest */
  rest: Rest | null;
  /** of the last */
  self_test: SelfTestReport | null;
  pre_launch: PreLaunchProgress | null;
  /** of the last */
  pre_launch_outcome: PreLaunchOutcome | null;
  counters: Array<Counter>;
  /** each kind once */
  faults: Array<Fault>;
  last_fault: string | null;
  /** from receiving a raw message to having published the result */
  latency: Latency;
}

export type State = "standby" | "self-test" | "pre-launch calibration" | "running with mode reversal" | "running without mode reversal";

export type Output = "calibrated" | "pass-through" | "held";

export interface ActiveCalibration {
  revision: Revision;
  /** SHA-256 */
  digest: string | null;
  created_unix_s: number | null;
  age_s: number | null;
  source: string;
  /** its SHA-256 */
  overlay: string | null;
}

export interface PendingChange {
  revision: Revision;
  digest: string | null;
  source: string;
  /** first tick at or after */
  schedule: Schedule;
  slew_s: number | null;
}

export type Schedule = "next-tick" | { "sequence": number } | { "time-ns": number };

export interface Swaps {
  accepted: number;
  refused: number;
  last_refusal: string | null;
}

export interface LastTick {
  end_time_ns: number;
  sequence: number;
  series: number;
}

export interface ChannelStatus {
  name: string;
  /** none before the first reading */
  temperature_deg_c: number | null;
  /** none before the first reading */
  rate_deg_c_per_s: number | null;
  stale: boolean;
  warming_up: boolean;
  calibrated_range_deg_c: Array<number | null> | null;
  /** that range */
  place: Place | null;
}

export type Place = "below" | "inside" | "above";

export interface SensorStatus {
  name: string;
  kind: SensorKind;
  /** of the last tick */
  flags: number;
  /** ticks with that flag */
  ticks: number;
  /** ticks with that flag */
  invalid: number;
  /** ticks with that flag */
  overrange: number;
  /** ticks with that flag */
  not_finite: number;
  /** ticks with that flag */
  clamped: number;
  /** ticks with that flag */
  stale: number;
  /** ticks with that flag */
  excluded: number;
}

export type SensorKind = "gyro" | "accel";

export interface InputRates {
  gyro_ticks_per_s: number | null;
  accel_ticks_per_s: number | null;
  temperature_readings_per_s: number | null;
  messages_per_s: number | null;
}

export interface AppliedCorrection {
  angular_rate_rad_per_s: Array<number | null>;
  specific_force_m_per_s2: Array<number | null>;
}

export interface DriftStatus {
  gyro: string;
  rate_rad_per_s: number | null;
  sigma_rad_per_s: number | null;
  trend_rad_per_s2: number | null;
  updates: number;
  refused: number;
  /** mean squared normalised innovation, about 1 */
  mean_nis: number | null;
  last_update_ns: number | null;
  subtracted: boolean;
}

export type Rest = "learning" | "still" | { "moved": string };

export interface SelfTestReport {
  passed: boolean;
  ended_ns: number | null;
  length_s: number | null;
  items: Array<SelfTestItem>;
}

export interface SelfTestItem {
  name: string;
  value: number | null;
  at_least: number | null;
  at_most: number | null;
  unit_of_measure: string;
  passed: boolean;
}

export interface PreLaunchProgress {
  elapsed_s: number | null;
  duration_s: number | null;
  gyros: Array<PreLaunchGyro>;
}

export interface PreLaunchGyro {
  name: string;
  modes: Array<PreLaunchMode>;
  sigma_rad_per_s: number | null;
}

export interface PreLaunchMode {
  mode: Mode | null;
  ticks: number;
  time_s: number | null;
  mean_temperature_deg_c: number | null;
}

export interface PreLaunchOutcome {
  ended_ns: number | null;
  verdict: Verdict;
  /** SHA-256 */
  overlay: string | null;
}

export type Verdict = { "accepted": Array<ConstantsChange> } | { "refused": Array<string> } | "aborted";

export interface ConstantsChange {
  gyro: string;
  /** C0 */
  static_bias_change_rad_per_s: number | null;
  /** C0 */
  static_bias_sigma_rad_per_s: number | null;
  /** B0; none without modes */
  magnetic_bias_change_rad_per_s: number | null;
  /** B0; none without modes */
  magnetic_bias_sigma_rad_per_s: number | null;
  /** subtracted */
  earth_rate_rad_per_s: number | null;
  modes: Array<PreLaunchMode>;
}

export interface Counter {
  name: string;
  value: number;
}

export interface Fault {
  kind: string;
  count: number;
  first: string;
  last_unix_ms: number;
}

export interface Latency {
  p50_ns: number;
  p99_ns: number;
  p999_ns: number;
  max_ns: number;
  /** not cumulative */
  buckets: Array<LatencyBucket>;
}

export interface LatencyBucket {
  up_to_ns: number;
  count: number;
}

export interface Status1 {
  unit: string;
  service_version: string;
  state: State1;
  revision: Revision;
  last_end_time_ns: number | null;
  last_sequence: number | null;
  channels: Array<ChannelStatus1>;
  counters: Array<Counter>;
  last_fault: string | null;
  added_latency_p50_ns: number;
  added_latency_p99_ns: number;
}

export type State1 = "Uncalibrated" | "Held" | "Running";

export interface ChannelStatus1 {
  channel: string;
  temperature_deg_c: number | null;
  rate_deg_c_per_s: number | null;
  stale: boolean;
  warming_up: boolean;
}

export interface ServiceStatus {
  instance: string;
  version: string;
  /** none if embedded */
  pid: number | null;
  started_unix_ms: number;
  uptime_s: number | null;
  units: Array<UnitSummary>;
  /** folder */
  calibrations: FolderStatus | null;
  bad_documents: Array<BadDocument>;
  /** state folder */
  store: StoreStatus | null;
  /** of no unit, such as state_folder, audit_file */
  faults: Array<Fault>;
  /** SHA-256 of the configuration file */
  settings_digest: string | null;
  /** over all units */
  swaps_accepted: number;
  /** over all units */
  swaps_refused: number;
}

export interface UnitSummary {
  unit: string;
  state: State;
  output: Output;
}

export interface FolderStatus {
  path: string;
  state: FolderState;
  reason: string | null;
}

export type FolderState = "watching" | "polling" | "gone";

export interface BadDocument {
  file: string;
  problem: string;
  problems: number;
}

export interface StoreStatus {
  path: string;
  audit_entries: number;
}

export interface JournalPart {
  unit: string;
  instance: string;
  /** consecutive from 1 per unit and instance */
  number: number;
  /** part < parts, 1…64 parts, in order */
  part: number;
  /** part < parts, 1…64 parts, in order */
  parts: number;
  /** of the entry */
  bytes: Array<number>;
}
