"""Client of Isotherm, which corrects gyros and accelerometers in real time.

    with isotherm.connect() as bus:
        for batch in bus.corrected("ZLG-0001"):
            print(batch.ticks["delta_angle_rad"])

Live: `connect`, `Bus`, `CorrectedStream`, `Producer`. Files: `read_recording`, `read_parquet`, `read_wire`. A look: `plot`. Frames:
`decode`, `encode`, `CorrectedDecoder`. Rules: `Account` (continuity), `FirstWins` (two services). Bits of `flags`: `TickFlag`; of
`gyro_flags` and `accel_flags`: `SensorFlag`. What fields mean, and their units of measure: docs/wire.md.
"""

from enum import IntFlag

from . import _layout
from ._account import Account, FirstWins
from ._arrays import TICK, CorrectedBatch, CorrectedDecoder, angular_rate, specific_force
from ._bus import ENDPOINT, Bus, BusError, NotAccepted, connect, wait_for_receipts
from ._files import (
    RAW_ACCEL_TICK,
    RAW_GYRO_TICK,
    TEMPERATURE_READING,
    Recording,
    Unreadable,
    read_parquet,
    read_recording,
    read_wire,
)
from ._layout import CORRECTED, JOURNAL, RAW_ACCEL, RAW_GYRO, RAW_HEALTH, RAW_TEMPERATURE, REFERENCE, SERVICE_STATUS, STATUS
from ._plot import plot
from ._producer import Producer
from ._stream import CorrectedStream, StatusStream
from ._rules import Refused
from ._wire import decode, encode

__version__ = "0.1.0"

TickFlag = IntFlag("TickFlag", _layout.TICK_FLAGS)  # type: ignore[misc]
SensorFlag = IntFlag("SensorFlag", _layout.SENSOR_FLAGS)  # type: ignore[misc]

__all__ = [
    "Account",
    "Bus",
    "BusError",
    "CORRECTED",
    "CorrectedBatch",
    "CorrectedDecoder",
    "CorrectedStream",
    "ENDPOINT",
    "FirstWins",
    "JOURNAL",
    "NotAccepted",
    "Producer",
    "RAW_ACCEL",
    "RAW_ACCEL_TICK",
    "RAW_GYRO",
    "RAW_GYRO_TICK",
    "RAW_HEALTH",
    "RAW_TEMPERATURE",
    "REFERENCE",
    "Recording",
    "Refused",
    "SERVICE_STATUS",
    "STATUS",
    "SensorFlag",
    "StatusStream",
    "TEMPERATURE_READING",
    "TICK",
    "TickFlag",
    "Unreadable",
    "angular_rate",
    "connect",
    "decode",
    "encode",
    "plot",
    "read_parquet",
    "read_recording",
    "read_wire",
    "specific_force",
    "wait_for_receipts",
]
