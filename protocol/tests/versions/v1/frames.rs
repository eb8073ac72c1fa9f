//! The bytes. See the parent module before you touch them.

/// Name and frame, in hexadecimal.
pub(in super::super) const FRAMES: &[(&str, &str)] = &[
    (
        "raw-gyro-counts",
        "
        01 01 e8 07 80 80 a8 b1 e3 9f e7 cb 17 02 80 ad e2 04 c0 96 b1 02 00 03 a4 13 ed 08 00 01 00 00
        00 03 d0 0f d4 03 d7 04 95 04 80 01 7f f6 db c4 09 bb 97 b1 02 00 03 18 06 07 01 01 01 01 00 00
        55 2f 63 58
        ",
    ),
    (
        "raw-gyro-means",
        "
        01 01 00 00 01 01 80 ad e2 04 01 08 00 00 00 00 00 00 e0 3f 00 00 00 00 00 00 d0 bf fc a9 f1 d2
        4d 62 50 3f fc a9 f1 d2 4d 62 50 bf 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 80 00 00 00 00
        00 00 f8 7f c9 d3 a8 76 3c 1c 13 3f 00 00 00 00 76 71 d9 09
        ",
    ),
    (
        "raw-gyro-edges",
        "
        01 01 ff ff ff ff ff ff ff ff ff 01 ff ff ff ff ff ff ff ff ff 01 01 ff ff ff ff ff ff ff ff ff
        01 ff ff ff ff ff ff ff ff ff 01 00 08 ff ff ff ff 0f fe ff ff ff 0f 01 02 7e 7f 80 01 81 01 01
        01 01 01 01 08 ff ff ff ff 0f fe ff ff ff 0f ff ff ff ff 0f fe ff ff ff 0f ff ff ff ff 0f fe ff
        ff ff 0f ff ff ff ff 0f fe ff ff ff 0f ff ff ff ff 0f fe ff ff ff 0f ff ff ff ff 0f fe ff ff ff
        0f ff ff ff ff 0f fe ff ff ff 0f ff ff ff ff 0f fe ff ff ff 0f 87 90 8f 6e
        ",
    ),
    ("raw-gyro-empty", "01 01 80 01 00 01 00 00 00 00 00 00 00 00 57 e5 10 27"),
    (
        "raw-accel-counts",
        "
        02 01 ac 02 02 80 ad e2 04 c0 96 b1 02 00 03 00 01 90 06 80 da c4 09 c0 96 b1 02 00 03 02 03 92
        06 97 58 19 53
        ",
    ),
    (
        "raw-accel-means",
        "
        02 01 80 80 80 80 10 01 fe ff ff ff ff ff ff ff ff 01 01 01 04 05 a3 92 3a 01 9d 23 40 00 00 00
        00 00 00 c0 bf 00 00 00 00 00 00 00 00 00 00 00 00 00 80 23 c0 f3 56 5f d1
        ",
    ),
    (
        "raw-temp",
        "
        03 01 02 04 62 6f 64 79 0e d0 ba d0 b0 d1 82 d1 83 d1 88 d0 ba d0 b0 02 80 a8 d6 b9 07 02 66 66
        66 66 66 66 e0 3f 00 00 00 00 00 00 f8 7f 80 bc c1 96 0b 02 00 00 00 00 00 00 e0 3f 00 00 00 00
        00 20 44 c0 21 07 83 ff
        ",
    ),
    ("raw-temp-empty", "03 01 00 01 0e 00 04 bd 77 95"),
    (
        "corrected",
        "
        04 01 08 5a 4c 47 2d 30 30 34 32 03 01 23 45 67 89 ab cd ef 01 04 62 6f 64 79 00 00 00 00 00 20
        39 40 8f 53 74 24 97 ff 90 bf 02 e8 07 80 ad e2 04 c0 96 b1 02 01 00 5f 19 65 47 f4 7c 97 3e 2d
        43 1c eb e2 36 ea be 8d ed b5 a0 f7 c6 c0 3e 00 00 00 00 00 00 00 00 fc a9 f1 d2 4d 62 50 bf 4a
        0c 02 2b 87 16 a9 3f 01 00 08 03 01 01 05 03 01 01 01 00 00 ef 07 80 e8 92 26 80 da c4 09 04 03
        54 e4 10 71 73 2a b9 3e 2d 43 1c eb e2 36 0a bf 8d ed b5 a0 f7 c6 e0 3e 00 00 00 00 00 00 00 00
        00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 01 01 87 10 03 00 00 00 03 00 00 00 01 95 d6 26
        e8 0b 2e 11 3e 00 09 87 e7 0a
        ",
    ),
    (
        "corrected-edges",
        "
        04 01 01 78 ff ff ff ff ff ff ff ff ff 01 ff ff ff ff ff ff ff ff 00 01 ff ff ff ff ff ff ff ff
        ff 01 ff ff ff ff ff ff ff ff ff 01 ff ff ff ff ff ff ff ff ff 01 ff ff 03 ff ff ff ff ff ff ff
        ff ff 01 9c 75 00 88 3c e4 37 7e 00 00 00 00 00 00 00 80 01 00 00 00 00 00 00 00 00 00 00 00 00
        00 f8 7f 9c 75 00 88 3c e4 37 fe 9a 99 99 99 99 99 b9 3f 00 ff ff 03 08 01 02 04 08 10 20 80 ff
        00 05 9a 99 99 99 99 99 b9 3f 9a 99 99 99 99 99 c9 bf 33 33 33 33 33 33 d3 3f 9a 99 99 99 99 99
        d9 bf 00 00 00 00 00 00 e0 3f 01 00 00 00 00 00 00 f8 bf 05 95 7f 8c
        ",
    ),
    (
        "status",
        "
        05 01 08 5a 4c 47 2d 30 30 34 32 05 30 2e 31 2e 30 02 01 01 02 03 04 05 06 07 08 01 80 e8 92 26
        01 ef 07 02 04 62 6f 64 79 01 00 00 00 00 00 20 39 40 01 8f 53 74 24 97 ff 90 bf 00 01 04 63 6f
        69 6c 00 00 01 01 02 0d 67 79 72 6f 5f 74 69 63 6b 73 5f 69 6e ed 07 0a 62 61 64 5f 66 72 61 6d
        65 73 00 01 1b 72 61 77 2f 67 79 72 6f 3a 20 62 6f 64 79 20 69 73 20 6d 61 6c 66 6f 72 6d 65 64
        88 a4 01 e0 c5 08 bb 16 34 00
        ",
    ),
    (
        "status-edges",
        "
        05 01 01 78 00 01 00 00 00 00 00 00 00 00 00 01 ff ff ff ff ff ff ff ff ff 01 01 ff ff ff ff ff
        ff ff ff ff 01 00 01 00 ff ff ff ff ff ff ff ff ff 01 00 00 ff ff ff ff ff ff ff ff ff 01 fe 69
        c0 d8
        ",
    ),
    (
        "status-new",
        "
        05 01 01 78 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 ff ff ff ff ff ff ff ff ff 01 e0
        04 4d f8
        ",
    ),
];
