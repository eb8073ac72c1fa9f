// Answers of the console's API, as `view.rs` makes them of the messages; `clients/typescript/check.sh` holds the scripts to them.
import type * as wire from "../../../../../clients/typescript/isotherm";

declare global {
  /** Of `pages`. */
  class Chart {
    constructor(...parts: Array<any>);
    [name: string]: any;
  }

  type Status = wire.Status;
  type Verdict = wire.Verdict;
  type TestItem = wire.SelfTestItem;
  type Latency = wire.Latency;

  interface Overview {
    instance: string;
    write: boolean;
    options: string;
    now_unix_ms: number;
    services: Array<wire.ServiceStatus & { name: string; gone: boolean }>;
    units: Array<Row>;
    pair: Array<{ level: string; columns: Array<string> }>;
  }

  interface Said {
    level: string;
    words: string;
  }

  interface Row {
    unit: string;
    instance: string;
    level: string;
    reasons: Array<string>;
    state: string;
    running: boolean;
    revision: number | null;
    digest: string | null;
    temperature_deg_c: number | null;
    temperature_rate_deg_c_per_s: number | null;
    calibrated_range_deg_c: Array<number> | null;
    range: string;
    correction_deg_per_h: number | null;
    correction_mg: number | null;
    raw_ticks_per_s: number | null;
    p99_ns: number;
    gaps: number;
    duplicates: number;
    late: number;
    bad: number;
  }

  interface Sheet {
    now_unix_ms: number;
    instances: Array<Instance>;
    pair: Array<Half>;
  }

  interface Half {
    own: boolean;
    name: string;
    priority: number;
    unit: string;
    role: string;
    ticks_compared: number;
    ticks_differing: number;
    takeovers: number;
    last_difference?: string;
  }

  interface Instance {
    own: boolean;
    level: string;
    remarks: Array<Said>;
    gone_s: number | null;
    allowed: Array<string>;
    status: Status;
    /** Age (s), then the temperature of each channel (°C). */
    past: Array<Array<number>>;
  }
}
