/*
 * Isotherm's wire messages in C99: one header, no allocation, no I/O, no library but string.h.
 *
 *     isotherm_corrected_batch_3 batch;
 *     if (isotherm_decode_corrected(frame, length, &batch) == ISOTHERM_OK) {
 *         isotherm_corrected_tick tick;
 *         while (isotherm_next_corrected_tick(&batch.ticks, &tick)) use(tick.delta_angle_rad);
 *     }
 *
 * Decoding checks the whole frame first and reads nothing beyond it. Texts and long lists stay in the frame: an isotherm_view
 * points to its bytes, an isotherm_list is walked with its isotherm_next_*. Keep the frame as long as you use them.
 *
 * #define ISOTHERM_FLOAT before including it where there is no double: numbers are rounded to float, and no double is used.
 * Fields, units of measure, limits: docs/wire.md. Byte order of the host and alignment do not matter. Safe on any thread; nothing is
 * global. The functions are static: include it in as many files as you like.
 */
#ifndef ISOTHERM_H
#define ISOTHERM_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#ifdef ISOTHERM_FLOAT
typedef float isotherm_real;
#else
typedef double isotherm_real;
#endif

/* Why a frame is refused, or cannot be written. */
typedef enum {
    ISOTHERM_OK,
    ISOTHERM_LENGTH,
    ISOTHERM_KIND,
    ISOTHERM_VERSION,
    ISOTHERM_CHECKSUM,
    ISOTHERM_BODY,
    ISOTHERM_LEFT_OVER,
    ISOTHERM_RULE,
    ISOTHERM_ROOM
} isotherm_result;

/* The same in words. */
static inline const char *isotherm_words(isotherm_result result) {
    switch (result) {
    case ISOTHERM_OK: return "ok";
    case ISOTHERM_LENGTH: return "the frame is shorter than 6 or longer than 1048576 bytes";
    case ISOTHERM_KIND: return "the frame is of another kind than its key";
    case ISOTHERM_VERSION: return "the frame's version is not known here: update isotherm.h";
    case ISOTHERM_CHECKSUM: return "the checksum does not fit: the bytes changed on their way";
    case ISOTHERM_BODY: return "the body does not decode: cut short, or a value beyond its limit";
    case ISOTHERM_LEFT_OVER: return "bytes are left over after the body";
    case ISOTHERM_RULE: return "fields contradict each other";
    case ISOTHERM_ROOM: return "the buffer is too small, or a value beyond its limit";
    }
    return "no such result";
}

/* Bytes of the frame; a text is UTF-8 without a 0 at its end. */
typedef struct {
    const uint8_t *at;
    size_t length;
} isotherm_view;

/* Elements of the frame that are still to be walked. */
typedef struct {
    const uint8_t *at, *end;
    uint32_t count;
} isotherm_list;

/* A place in a body. */
typedef struct {
    const uint8_t *at, *end;
} isotherm_cursor;

/* A frame that is being written; `ok` becomes false for good when something does not fit. */
typedef struct {
    uint8_t *start, *at, *end;
    bool ok;
    /* Ticks still to come, and the shape that they share. */
    uint32_t left, readings;
    bool means, begun;
} isotherm_writer;

/* CRC-32 as in zlib; four bits at a time, so that the table takes 64 bytes. */
static inline uint32_t isotherm_crc32(const uint8_t *bytes, size_t length) {
    static const uint32_t table[16] = {
        0x00000000u, 0x1db71064u, 0x3b6e20c8u, 0x26d930acu, 0x76dc4190u, 0x6b6b51f4u, 0x4db26158u, 0x5005713cu,
        0xedb88320u, 0xf00f9344u, 0xd6d6a3e8u, 0xcb61b38cu, 0x9b64c2b0u, 0x86d3d2d4u, 0xa00ae278u, 0xbdbdf21cu};
    uint32_t crc = 0xffffffffu;
    for (size_t i = 0; i < length; ++i) {
        crc ^= bytes[i];
        crc = (crc >> 4) ^ table[crc & 15u];
        crc = (crc >> 4) ^ table[crc & 15u];
    }
    return crc ^ 0xffffffffu;
}

/* Reading. Each function returns false where the bytes end too early or the value is beyond its limit. */

static inline bool isotherm_get_u8(isotherm_cursor *c, uint8_t *to) {
    if (c->at == c->end) return false;
    *to = *c->at++;
    return true;
}

static inline bool isotherm_get_bool(isotherm_cursor *c, bool *to) {
    uint8_t byte = 0;
    if (!isotherm_get_u8(c, &byte) || byte > 1) return false;
    *to = byte == 1;
    return true;
}

static inline bool isotherm_get_varint(isotherm_cursor *c, unsigned bits, uint64_t *to) {
    uint64_t value = 0;
    for (unsigned shift = 0; shift < bits; shift += 7) {
        uint8_t byte = 0;
        if (!isotherm_get_u8(c, &byte)) return false;
        const uint64_t part = byte & 0x7fu;
        if (bits - shift < 7 && part >> (bits - shift) != 0) return false;
        value |= part << shift;
        if (byte < 0x80u) {
            *to = value;
            return true;
        }
    }
    return false;
}

static inline bool isotherm_get_u64(isotherm_cursor *c, uint64_t *to) { return isotherm_get_varint(c, 64, to); }

static inline bool isotherm_get_u32(isotherm_cursor *c, uint32_t *to) {
    uint64_t value = 0;
    const bool read = isotherm_get_varint(c, 32, &value);
    *to = (uint32_t)value;
    return read;
}

static inline bool isotherm_get_u16(isotherm_cursor *c, uint16_t *to) {
    uint64_t value = 0;
    const bool read = isotherm_get_varint(c, 16, &value);
    *to = (uint16_t)value;
    return read;
}

/* 0, 1, 2, 3 are 0, -1, 1, -2. */
static inline int64_t isotherm_unzigzag(uint64_t value) {
    const int64_t half = (int64_t)(value >> 1);
    return value & 1u ? -half - 1 : half;
}

static inline bool isotherm_get_i64(isotherm_cursor *c, int64_t *to) {
    uint64_t value = 0;
    const bool read = isotherm_get_varint(c, 64, &value);
    *to = isotherm_unzigzag(value);
    return read;
}

static inline bool isotherm_get_i32(isotherm_cursor *c, int32_t *to) {
    uint64_t value = 0;
    const bool read = isotherm_get_varint(c, 32, &value);
    *to = (int32_t)isotherm_unzigzag(value);
    return read;
}

#ifdef ISOTHERM_FLOAT
/* binary64 to binary32, to the nearest, ties to even. */
static inline uint32_t isotherm_narrow(uint64_t bits) {
    const uint32_t sign = (uint32_t)(bits >> 32) & 0x80000000u;
    const int32_t exponent = (int32_t)(bits >> 52 & 0x7ffu) - 1023;
    uint64_t fraction = bits & 0xfffffffffffffu;
    if (exponent == 1024) return sign | 0x7f800000u | (fraction != 0 ? 0x400000u | (uint32_t)(fraction >> 29) : 0);
    if (exponent > 127) return sign | 0x7f800000u;
    if (exponent < -150) return sign;
    unsigned shift = 29;
    uint32_t high = (uint32_t)(exponent + 127) << 23;
    if (exponent < -126) {
        fraction |= UINT64_C(1) << 52;
        shift = (unsigned)(29 + -126 - exponent);
        high = 0;
    }
    uint32_t low = (uint32_t)(fraction >> shift);
    const uint64_t rest = fraction & ((UINT64_C(1) << shift) - 1), half = UINT64_C(1) << (shift - 1);
    if (rest > half || (rest == half && (low & 1u) != 0)) ++low;
    /* A carry goes into the exponent, as it must. */
    return sign | (high + low);
}

static inline uint64_t isotherm_widen(uint32_t bits) {
    const uint64_t sign = (uint64_t)(bits & 0x80000000u) << 32;
    uint64_t fraction = bits & 0x7fffffu;
    uint64_t exponent = bits >> 23 & 0xffu;
    if (exponent == 255) return sign | UINT64_C(0x7ff0000000000000) | fraction << 29;
    if (exponent == 0) {
        if (fraction == 0) return sign;
        exponent = 1;
        while ((fraction & 0x800000u) == 0) {
            fraction <<= 1;
            --exponent;
        }
        fraction &= 0x7fffffu;
    }
    return sign | (exponent + 896) << 52 | fraction << 29;
}
#endif

static inline bool isotherm_get_real(isotherm_cursor *c, isotherm_real *to) {
    if ((size_t)(c->end - c->at) < 8) return false;
    uint64_t bits = 0;
    for (unsigned i = 0; i < 8; ++i) bits |= (uint64_t)c->at[i] << (8 * i);
    c->at += 8;
#ifdef ISOTHERM_FLOAT
    const uint32_t narrow = isotherm_narrow(bits);
    memcpy(to, &narrow, sizeof *to);
#else
    memcpy(to, &bits, sizeof *to);
#endif
    return true;
}

static inline bool isotherm_get_bytes(isotherm_cursor *c, size_t count, uint8_t *to) {
    if ((size_t)(c->end - c->at) < count) return false;
    memcpy(to, c->at, count);
    c->at += count;
    return true;
}

static inline bool isotherm_get_count(isotherm_cursor *c, uint32_t least, uint32_t most, uint32_t *to) {
    uint64_t count = 0;
    if (!isotherm_get_u64(c, &count) || count < least || count > most) return false;
    *to = (uint32_t)count;
    return true;
}

static inline bool isotherm_get_view(isotherm_cursor *c, uint32_t least, uint32_t most, isotherm_view *to) {
    uint32_t count = 0;
    if (!isotherm_get_count(c, least, most, &count) || (size_t)(c->end - c->at) < count) return false;
    to->at = c->at;
    to->length = count;
    c->at += count;
    return true;
}

/* Whether bytes are UTF-8: shortest form, no surrogates, nothing above U+10FFFF. */
static inline bool isotherm_is_utf8(const uint8_t *at, size_t length) {
    size_t i = 0;
    while (i < length) {
        const uint8_t first = at[i++];
        if (first < 0x80u) continue;
        const unsigned more = first >= 0xf0u ? 3 : first >= 0xe0u ? 2 : 1;
        if (first < 0xc2u || first > 0xf4u || length - i < more) return false;
        const uint8_t second = at[i];
        if ((first == 0xe0u && second < 0xa0u) || (first == 0xedu && second > 0x9fu) || (first == 0xf0u && second < 0x90u)
            || (first == 0xf4u && second > 0x8fu)) {
            return false;
        }
        for (unsigned k = 0; k < more; ++k) {
            if ((at[i++] & 0xc0u) != 0x80u) return false;
        }
    }
    return true;
}

static inline bool isotherm_get_text(isotherm_cursor *c, uint32_t most, isotherm_view *to) {
    return isotherm_get_view(c, 0, most, to) && isotherm_is_utf8(to->at, to->length);
}

/* Walks a list of texts. */
static inline bool isotherm_next_text(isotherm_list *list, isotherm_view *item) {
    isotherm_cursor c = {list->at, list->end};
    if (list->count == 0 || !isotherm_get_text(&c, UINT32_MAX, item)) return false;
    list->at = c.at;
    --list->count;
    return true;
}

/* Writing. */

static inline void isotherm_put_u8(isotherm_writer *w, uint8_t value) {
    if (w->at == w->end) w->ok = false;
    if (w->ok) *w->at++ = value;
}

static inline void isotherm_put_bool(isotherm_writer *w, bool value) { isotherm_put_u8(w, value ? 1 : 0); }

static inline void isotherm_put_u64(isotherm_writer *w, uint64_t value) {
    for (; value >= 0x80u; value >>= 7) isotherm_put_u8(w, (uint8_t)(value | 0x80u));
    isotherm_put_u8(w, (uint8_t)value);
}

static inline void isotherm_put_i64(isotherm_writer *w, int64_t value) {
    isotherm_put_u64(w, value < 0 ? ((uint64_t)-(value + 1) << 1) + 1 : (uint64_t)value << 1);
}

static inline void isotherm_put_i32(isotherm_writer *w, int32_t value) { isotherm_put_i64(w, value); }

static inline void isotherm_put_real(isotherm_writer *w, isotherm_real value) {
    uint64_t bits = 0;
#ifdef ISOTHERM_FLOAT
    uint32_t narrow = 0;
    memcpy(&narrow, &value, sizeof narrow);
    bits = isotherm_widen(narrow);
#else
    memcpy(&bits, &value, sizeof bits);
#endif
    for (unsigned i = 0; i < 8; ++i) isotherm_put_u8(w, (uint8_t)(bits >> (8 * i)));
}

static inline void isotherm_put_count(isotherm_writer *w, uint32_t most, uint32_t count) {
    if (count > most) w->ok = false;
    isotherm_put_u64(w, count);
}

static inline void isotherm_put_variant(isotherm_writer *w, uint32_t variants, uint32_t variant) {
    if (variant >= variants) w->ok = false;
    isotherm_put_u64(w, variant);
}

static inline void isotherm_put_text(isotherm_writer *w, uint32_t most, isotherm_view text) {
    if (text.length > most || !isotherm_is_utf8(text.at, text.length)) w->ok = false;
    if (!w->ok) return;
    isotherm_put_u64(w, text.length);
    for (size_t i = 0; i < text.length; ++i) isotherm_put_u8(w, text.at[i]);
}

/* generated: types */
#define ISOTHERM_MAX_ALL_SENSORS 16u
#define ISOTHERM_MAX_BAD_DOCUMENTS 64u
#define ISOTHERM_MAX_BUCKETS 1024u
#define ISOTHERM_MAX_CHANNEL_NAME_BYTES 24u
#define ISOTHERM_MAX_CHANNELS 16u
#define ISOTHERM_MAX_ENTRIES 256u
#define ISOTHERM_MAX_FAULTS 32u
#define ISOTHERM_MAX_FRAME_BYTES 1048576u
#define ISOTHERM_MIN_FRAME_BYTES 6u
#define ISOTHERM_MAX_HEALTH_READINGS 64u
#define ISOTHERM_MAX_MODES 3u
#define ISOTHERM_MAX_PARITY 5u
#define ISOTHERM_MAX_PART_BYTES 524288u
#define ISOTHERM_MAX_PARTS 64u
#define ISOTHERM_MAX_REASONS 64u
#define ISOTHERM_MAX_SENSORS 8u
#define ISOTHERM_MAX_TICKS 4096u
#define ISOTHERM_MAX_UNIT_BYTES 64u
#define ISOTHERM_MAX_UNITS 4096u

#define ISOTHERM_KIND_RAW_GYRO 1u
#define ISOTHERM_KIND_RAW_ACCEL 2u
#define ISOTHERM_KIND_RAW_TEMPERATURE 3u
#define ISOTHERM_KIND_CORRECTED 4u
#define ISOTHERM_KIND_STATUS 5u
#define ISOTHERM_KIND_RAW_HEALTH 6u
#define ISOTHERM_KIND_SERVICE_STATUS 7u
#define ISOTHERM_KIND_REFERENCE 8u
#define ISOTHERM_KIND_JOURNAL 9u

/* angle predicted over a mode switch */
#define ISOTHERM_TICK_INTERPOLATED (1u << 0)
/* `missed` ticks precede: bridge them */
#define ISOTHERM_TICK_GAP (1u << 1)
/* no accelerometer tick: velocity is zero, in a step partial: bridge it */
#define ISOTHERM_TICK_ACCELEROMETER_MISSING (1u << 2)
/* temperature rates have not settled */
#define ISOTHERM_TICK_WARM_UP (1u << 3)
/* the first three raw readings */
#define ISOTHERM_TICK_UNCALIBRATED (1u << 4)
/* includes angle of an earlier mode switch: take no rate from it */
#define ISOTHERM_TICK_ANGLE_RESTORED (1u << 5)
/* a mode switch could not be restored */
#define ISOTHERM_TICK_SWITCH_UNRESOLVED (1u << 6)
/* coning and sculling are included */
#define ISOTHERM_TICK_CONING_SCULLING (1u << 7)
/* sequence or time restarted */
#define ISOTHERM_TICK_RESTART (1u << 8)
/* a redundant sensor is failing */
#define ISOTHERM_TICK_PARITY_EXCEEDED (1u << 9)
/* do not use: usable gyros do not span three axes, or uncalibrated */
#define ISOTHERM_TICK_ANGLE_INVALID (1u << 10)
/* likewise, of accelerometers; or their tick lasts a quarter longer or shorter */
#define ISOTHERM_TICK_VELOCITY_INVALID (1u << 11)
/* servo transient subtracted */
#define ISOTHERM_TICK_SERVO_TRANSIENT (1u << 12)
/* servo transient without usable half-period counts */
#define ISOTHERM_TICK_SERVO_UNMEASURED (1u << 13)
/* none is missing, but the last end and this start are half a tick apart */
#define ISOTHERM_TICK_TIME_STEP (1u << 14)

/* used as read */
#define ISOTHERM_SENSOR_VALID (1u << 0)
/* at or beyond the input limit */
#define ISOTHERM_SENSOR_OVERRANGE (1u << 1)
/* outside the fitted range of a term or the orientation */
#define ISOTHERM_SENSOR_CLAMPED_TEMPERATURE (1u << 2)
/* temperature missing, rejected or too old */
#define ISOTHERM_SENSOR_STALE_TEMPERATURE (1u << 3)
/* the last valid value stands in */
#define ISOTHERM_SENSOR_NOT_FINITE (1u << 4)
/* excluded by the parity check */
#define ISOTHERM_SENSOR_EXCLUDED (1u << 5)
/* outside the range of the weight over rate */
#define ISOTHERM_SENSOR_CLAMPED_RATE (1u << 6)

typedef enum {
    ISOTHERM_READINGS_COUNTS,
    ISOTHERM_READINGS_MEANS
} isotherm_readings_variant;
typedef struct {
    isotherm_readings_variant variant;
    uint32_t counts_count;
    int32_t counts[8];
    uint32_t means_count;
    isotherm_real means[8];
} isotherm_readings;

typedef enum {
    ISOTHERM_MODE_PLUS,
    ISOTHERM_MODE_MINUS
} isotherm_mode;

typedef struct {
    int32_t positive;
    int32_t negative;
} isotherm_half_period;

typedef struct {
    int64_t end_time_ns;
    uint64_t duration_ns;
    isotherm_readings readings;
    bool has_mode;
    isotherm_mode mode;
    bool switch_command;
    bool has_meander;
    isotherm_mode meander;
    uint32_t half_periods_count;
    isotherm_half_period half_periods[8];
} isotherm_gyro_tick;

typedef struct {
    uint64_t first_sequence;
    uint64_t series;
    isotherm_list ticks;
} isotherm_gyro_batch;

typedef struct {
    int64_t end_time_ns;
    uint64_t duration_ns;
    isotherm_readings readings;
} isotherm_accelerometer_tick;

typedef struct {
    uint64_t first_sequence;
    isotherm_list ticks;
} isotherm_accelerometer_batch;

typedef struct {
    int64_t time_ns;
    uint32_t raw_count;
    isotherm_real raw[16];
} isotherm_temperature_tick;

typedef struct {
    uint32_t channels_count;
    isotherm_view channels[16];
    isotherm_list ticks;
} isotherm_temperature_batch;

typedef struct {
    isotherm_view name;
    isotherm_real value;
} isotherm_health_reading;

typedef struct {
    int64_t time_ns;
    isotherm_list readings;
} isotherm_health_tick;

typedef struct {
    isotherm_list ticks;
} isotherm_health_batch;

typedef struct {
    int64_t start_ns;
    int64_t end_ns;
    isotherm_real angular_rate_rad_per_s[3];
    isotherm_real sigma_rad_per_s;
} isotherm_rate_reference;

typedef struct {
    uint64_t counter;
    uint8_t digest[8];
} isotherm_revision;

typedef struct {
    isotherm_view channel;
    isotherm_real temperature_deg_c;
    isotherm_real rate_deg_c_per_s;
} isotherm_applied_temperature;

typedef struct {
    uint64_t sequence;
    int64_t end_time_ns;
    uint64_t duration_ns;
    uint16_t ticks;
    uint64_t missed;
    isotherm_real delta_angle_rad[3];
    isotherm_real delta_velocity_m_per_s[3];
    bool has_mode;
    isotherm_mode mode;
    uint16_t flags;
    uint32_t gyro_flags_count;
    uint8_t gyro_flags[8];
    uint32_t accel_flags_count;
    uint8_t accel_flags[8];
    uint32_t gyro_parity_rad_per_s_count;
    isotherm_real gyro_parity_rad_per_s[5];
    uint32_t accel_parity_m_per_s2_count;
    isotherm_real accel_parity_m_per_s2[5];
} isotherm_corrected_tick;

typedef struct {
    isotherm_view unit;
    isotherm_revision revision;
    uint32_t temperatures_count;
    isotherm_applied_temperature temperatures[16];
    isotherm_list ticks;
} isotherm_corrected_batch;

typedef struct {
    uint16_t from_tick;
    isotherm_real angle_noise_rad[3];
    isotherm_real angle_restoration_rad[3];
    isotherm_real angle_calibration_rad[3];
    isotherm_real angle_clamping_rad[3];
    isotherm_real velocity_noise_m_per_s[3];
    isotherm_real velocity_restoration_m_per_s[3];
    isotherm_real velocity_calibration_m_per_s[3];
    isotherm_real velocity_clamping_m_per_s[3];
} isotherm_sigma;

typedef struct {
    isotherm_view unit;
    isotherm_revision revision;
    uint32_t temperatures_count;
    isotherm_applied_temperature temperatures[16];
    isotherm_list ticks;
    isotherm_list sigmas;
} isotherm_corrected_batch_2;

typedef struct {
    isotherm_view unit;
    uint64_t series;
    isotherm_revision revision;
    uint32_t temperatures_count;
    isotherm_applied_temperature temperatures[16];
    isotherm_list ticks;
    isotherm_list sigmas;
} isotherm_corrected_batch_3;

typedef enum {
    ISOTHERM_STATE_STANDBY,
    ISOTHERM_STATE_SELF_TEST,
    ISOTHERM_STATE_PRE_LAUNCH_CALIBRATION,
    ISOTHERM_STATE_RUNNING_WITH_MODE_REVERSAL,
    ISOTHERM_STATE_RUNNING_WITHOUT_MODE_REVERSAL
} isotherm_state;

typedef enum {
    ISOTHERM_OUTPUT_CALIBRATED,
    ISOTHERM_OUTPUT_PASS_THROUGH,
    ISOTHERM_OUTPUT_HELD
} isotherm_output;

typedef struct {
    isotherm_revision revision;
    bool has_digest;
    uint8_t digest[32];
    bool has_created_unix_s;
    int64_t created_unix_s;
    bool has_age_s;
    int64_t age_s;
    isotherm_view source;
    bool has_overlay;
    uint8_t overlay[32];
} isotherm_active_calibration;

typedef enum {
    ISOTHERM_SCHEDULE_NEXT_TICK,
    ISOTHERM_SCHEDULE_SEQUENCE,
    ISOTHERM_SCHEDULE_TIME_NS
} isotherm_schedule_variant;
typedef struct {
    isotherm_schedule_variant variant;
    uint64_t sequence;
    int64_t time_ns;
} isotherm_schedule;

typedef struct {
    isotherm_revision revision;
    bool has_digest;
    uint8_t digest[32];
    isotherm_view source;
    isotherm_schedule schedule;
    isotherm_real slew_s;
} isotherm_pending_change;

typedef struct {
    uint64_t accepted;
    uint64_t refused;
    bool has_last_refusal;
    isotherm_view last_refusal;
} isotherm_swaps;

typedef struct {
    int64_t end_time_ns;
    uint64_t sequence;
    uint64_t series;
} isotherm_last_tick;

typedef enum {
    ISOTHERM_PLACE_BELOW,
    ISOTHERM_PLACE_INSIDE,
    ISOTHERM_PLACE_ABOVE
} isotherm_place;

typedef struct {
    isotherm_view name;
    bool has_temperature_deg_c;
    isotherm_real temperature_deg_c;
    bool has_rate_deg_c_per_s;
    isotherm_real rate_deg_c_per_s;
    bool stale;
    bool warming_up;
    bool has_calibrated_range_deg_c;
    isotherm_real calibrated_range_deg_c[2];
    bool has_place;
    isotherm_place place;
} isotherm_channel_status;

typedef enum {
    ISOTHERM_SENSOR_KIND_GYRO,
    ISOTHERM_SENSOR_KIND_ACCEL
} isotherm_sensor_kind;

typedef struct {
    isotherm_view name;
    isotherm_sensor_kind kind;
    uint8_t flags;
    uint64_t ticks;
    uint64_t invalid;
    uint64_t overrange;
    uint64_t not_finite;
    uint64_t clamped;
    uint64_t stale;
    uint64_t excluded;
} isotherm_sensor_status;

typedef struct {
    isotherm_real gyro_ticks_per_s;
    isotherm_real accel_ticks_per_s;
    isotherm_real temperature_readings_per_s;
    isotherm_real messages_per_s;
} isotherm_input_rates;

typedef struct {
    isotherm_real angular_rate_rad_per_s[3];
    isotherm_real specific_force_m_per_s2[3];
} isotherm_applied_correction;

typedef struct {
    isotherm_view gyro;
    isotherm_real rate_rad_per_s;
    isotherm_real sigma_rad_per_s;
    isotherm_real trend_rad_per_s2;
    uint64_t updates;
    uint64_t refused;
    bool has_mean_nis;
    isotherm_real mean_nis;
    bool has_last_update_ns;
    int64_t last_update_ns;
    bool subtracted;
} isotherm_drift_status;

typedef enum {
    ISOTHERM_REST_LEARNING,
    ISOTHERM_REST_STILL,
    ISOTHERM_REST_MOVED
} isotherm_rest_variant;
typedef struct {
    isotherm_rest_variant variant;
    isotherm_view moved;
} isotherm_rest;

typedef struct {
    isotherm_view name;
    bool has_value;
    isotherm_real value;
    bool has_at_least;
    isotherm_real at_least;
    bool has_at_most;
    isotherm_real at_most;
    isotherm_view unit_of_measure;
    bool passed;
} isotherm_self_test_item;

typedef struct {
    bool passed;
    bool has_ended_ns;
    int64_t ended_ns;
    isotherm_real length_s;
    isotherm_list items;
} isotherm_self_test_report;

typedef struct {
    bool has_mode;
    isotherm_mode mode;
    uint64_t ticks;
    isotherm_real time_s;
    bool has_mean_temperature_deg_c;
    isotherm_real mean_temperature_deg_c;
} isotherm_pre_launch_mode;

typedef struct {
    isotherm_view name;
    isotherm_list modes;
    bool has_sigma_rad_per_s;
    isotherm_real sigma_rad_per_s;
} isotherm_pre_launch_gyro;

typedef struct {
    isotherm_real elapsed_s;
    isotherm_real duration_s;
    isotherm_list gyros;
} isotherm_pre_launch_progress;

typedef struct {
    isotherm_view gyro;
    isotherm_real static_bias_change_rad_per_s;
    isotherm_real static_bias_sigma_rad_per_s;
    bool has_magnetic_bias_change_rad_per_s;
    isotherm_real magnetic_bias_change_rad_per_s;
    bool has_magnetic_bias_sigma_rad_per_s;
    isotherm_real magnetic_bias_sigma_rad_per_s;
    isotherm_real earth_rate_rad_per_s;
    isotherm_list modes;
} isotherm_constants_change;

typedef enum {
    ISOTHERM_VERDICT_ACCEPTED,
    ISOTHERM_VERDICT_REFUSED,
    ISOTHERM_VERDICT_ABORTED
} isotherm_verdict_variant;
typedef struct {
    isotherm_verdict_variant variant;
    isotherm_list accepted;
    isotherm_list refused;
} isotherm_verdict;

typedef struct {
    bool has_ended_ns;
    int64_t ended_ns;
    isotherm_verdict verdict;
    bool has_overlay;
    uint8_t overlay[32];
} isotherm_pre_launch_outcome;

typedef struct {
    isotherm_view name;
    uint64_t value;
} isotherm_counter;

typedef struct {
    isotherm_view kind;
    uint64_t count;
    isotherm_view first;
    int64_t last_unix_ms;
} isotherm_fault;

typedef struct {
    uint64_t up_to_ns;
    uint64_t count;
} isotherm_latency_bucket;

typedef struct {
    uint64_t p50_ns;
    uint64_t p99_ns;
    uint64_t p999_ns;
    uint64_t max_ns;
    isotherm_list buckets;
} isotherm_latency;

typedef struct {
    isotherm_view unit;
    isotherm_view instance;
    isotherm_view version;
    isotherm_state state;
    isotherm_output output;
    bool has_calibration;
    isotherm_active_calibration calibration;
    bool has_pending;
    isotherm_pending_change pending;
    isotherm_swaps swaps;
    bool has_last_tick;
    isotherm_last_tick last_tick;
    isotherm_list channels;
    isotherm_list sensors;
    isotherm_input_rates input_rates;
    bool has_applied;
    isotherm_applied_correction applied;
    isotherm_list drift;
    bool has_rest;
    isotherm_rest rest;
    bool has_self_test;
    isotherm_self_test_report self_test;
    bool has_pre_launch;
    isotherm_pre_launch_progress pre_launch;
    bool has_pre_launch_outcome;
    isotherm_pre_launch_outcome pre_launch_outcome;
    isotherm_list counters;
    isotherm_list faults;
    bool has_last_fault;
    isotherm_view last_fault;
    isotherm_latency latency;
} isotherm_status;

typedef enum {
    ISOTHERM_STATE_1_UNCALIBRATED,
    ISOTHERM_STATE_1_HELD,
    ISOTHERM_STATE_1_RUNNING
} isotherm_state_1;

typedef struct {
    isotherm_view channel;
    bool has_temperature_deg_c;
    isotherm_real temperature_deg_c;
    bool has_rate_deg_c_per_s;
    isotherm_real rate_deg_c_per_s;
    bool stale;
    bool warming_up;
} isotherm_channel_status_1;

typedef struct {
    isotherm_view unit;
    isotherm_view service_version;
    isotherm_state_1 state;
    isotherm_revision revision;
    bool has_last_end_time_ns;
    int64_t last_end_time_ns;
    bool has_last_sequence;
    uint64_t last_sequence;
    isotherm_list channels;
    isotherm_list counters;
    bool has_last_fault;
    isotherm_view last_fault;
    uint64_t added_latency_p50_ns;
    uint64_t added_latency_p99_ns;
} isotherm_status_1;

typedef struct {
    isotherm_view unit;
    isotherm_state state;
    isotherm_output output;
} isotherm_unit_summary;

typedef enum {
    ISOTHERM_FOLDER_STATE_WATCHING,
    ISOTHERM_FOLDER_STATE_POLLING,
    ISOTHERM_FOLDER_STATE_GONE
} isotherm_folder_state;

typedef struct {
    isotherm_view path;
    isotherm_folder_state state;
    bool has_reason;
    isotherm_view reason;
} isotherm_folder_status;

typedef struct {
    isotherm_view file;
    isotherm_view problem;
    uint64_t problems;
} isotherm_bad_document;

typedef struct {
    isotherm_view path;
    uint64_t audit_entries;
} isotherm_store_status;

typedef struct {
    isotherm_view instance;
    isotherm_view version;
    bool has_pid;
    uint32_t pid;
    int64_t started_unix_ms;
    isotherm_real uptime_s;
    isotherm_list units;
    bool has_calibrations;
    isotherm_folder_status calibrations;
    isotherm_list bad_documents;
    bool has_store;
    isotherm_store_status store;
    isotherm_list faults;
    bool has_settings_digest;
    uint8_t settings_digest[32];
    uint64_t swaps_accepted;
    uint64_t swaps_refused;
} isotherm_service_status;

typedef struct {
    isotherm_view unit;
    isotherm_view instance;
    uint64_t number;
    uint32_t part;
    uint32_t parts;
    isotherm_view bytes;
} isotherm_journal_part;

static inline bool isotherm_read_readings(isotherm_cursor *c, isotherm_readings *o) {
    uint32_t variant = 0;
    if (!isotherm_get_u32(c, &variant) || variant >= 2u) return false;
    memset(o, 0, sizeof *o);
    o->variant = (isotherm_readings_variant)variant;
    if (variant == 0u) {
        if (!isotherm_get_count(c, 0u, 8u, &o->counts_count)) return false;
        for (uint32_t i = 0; i < o->counts_count; ++i) {
            if (!isotherm_get_i32(c, &o->counts[i])) return false;
        }
    }
    if (variant == 1u) {
        if (!isotherm_get_count(c, 0u, 8u, &o->means_count)) return false;
        for (uint32_t i = 0; i < o->means_count; ++i) {
            if (!isotherm_get_real(c, &o->means[i])) return false;
        }
    }
    return true;
}

static inline bool isotherm_read_mode(isotherm_cursor *c, isotherm_mode *o) {
    uint32_t variant = 0;
    if (!isotherm_get_u32(c, &variant) || variant >= 2u) return false;
    *o = (isotherm_mode)variant;
    return true;
}

static inline bool isotherm_read_half_period(isotherm_cursor *c, isotherm_half_period *o) {
    memset(o, 0, sizeof *o);
    if (!isotherm_get_i32(c, &o->positive)) return false;
    if (!isotherm_get_i32(c, &o->negative)) return false;
    return true;
}

static inline bool isotherm_read_gyro_tick(isotherm_cursor *c, isotherm_gyro_tick *o) {
    memset(o, 0, sizeof *o);
    if (!isotherm_get_i64(c, &o->end_time_ns)) return false;
    if (!isotherm_get_u64(c, &o->duration_ns)) return false;
    if (!isotherm_read_readings(c, &o->readings)) return false;
    if (!isotherm_get_bool(c, &o->has_mode)) return false;
    if (o->has_mode) {
        if (!isotherm_read_mode(c, &o->mode)) return false;
    }
    if (!isotherm_get_bool(c, &o->switch_command)) return false;
    if (!isotherm_get_bool(c, &o->has_meander)) return false;
    if (o->has_meander) {
        if (!isotherm_read_mode(c, &o->meander)) return false;
    }
    if (!isotherm_get_count(c, 0u, 8u, &o->half_periods_count)) return false;
    for (uint32_t i = 0; i < o->half_periods_count; ++i) {
        if (!isotherm_read_half_period(c, &o->half_periods[i])) return false;
    }
    return true;
}

static inline bool isotherm_next_gyro_tick(isotherm_list *list, isotherm_gyro_tick *item) {
    isotherm_cursor c = {list->at, list->end};
    if (list->count == 0 || !isotherm_read_gyro_tick(&c, item)) return false;
    list->at = c.at;
    --list->count;
    return true;
}

static inline bool isotherm_read_gyro_batch(isotherm_cursor *c, isotherm_gyro_batch *o) {
    memset(o, 0, sizeof *o);
    if (!isotherm_get_u64(c, &o->first_sequence)) return false;
    if (!isotherm_get_u64(c, &o->series)) return false;
    if (!isotherm_get_count(c, 1u, 4096u, &o->ticks.count)) return false;
    o->ticks.at = c->at;
    for (uint32_t i = 0; i < o->ticks.count; ++i) {
        isotherm_gyro_tick item;
        if (!isotherm_read_gyro_tick(c, &item)) return false;
    }
    o->ticks.end = c->at;
    return true;
}

static inline bool isotherm_read_accelerometer_tick(isotherm_cursor *c, isotherm_accelerometer_tick *o) {
    memset(o, 0, sizeof *o);
    if (!isotherm_get_i64(c, &o->end_time_ns)) return false;
    if (!isotherm_get_u64(c, &o->duration_ns)) return false;
    if (!isotherm_read_readings(c, &o->readings)) return false;
    return true;
}

static inline bool isotherm_next_accelerometer_tick(isotherm_list *list, isotherm_accelerometer_tick *item) {
    isotherm_cursor c = {list->at, list->end};
    if (list->count == 0 || !isotherm_read_accelerometer_tick(&c, item)) return false;
    list->at = c.at;
    --list->count;
    return true;
}

static inline bool isotherm_read_accelerometer_batch(isotherm_cursor *c, isotherm_accelerometer_batch *o) {
    memset(o, 0, sizeof *o);
    if (!isotherm_get_u64(c, &o->first_sequence)) return false;
    if (!isotherm_get_count(c, 1u, 4096u, &o->ticks.count)) return false;
    o->ticks.at = c->at;
    for (uint32_t i = 0; i < o->ticks.count; ++i) {
        isotherm_accelerometer_tick item;
        if (!isotherm_read_accelerometer_tick(c, &item)) return false;
    }
    o->ticks.end = c->at;
    return true;
}

static inline bool isotherm_read_temperature_tick(isotherm_cursor *c, isotherm_temperature_tick *o) {
    memset(o, 0, sizeof *o);
    if (!isotherm_get_i64(c, &o->time_ns)) return false;
    if (!isotherm_get_count(c, 0u, 16u, &o->raw_count)) return false;
    for (uint32_t i = 0; i < o->raw_count; ++i) {
        if (!isotherm_get_real(c, &o->raw[i])) return false;
    }
    return true;
}

static inline bool isotherm_next_temperature_tick(isotherm_list *list, isotherm_temperature_tick *item) {
    isotherm_cursor c = {list->at, list->end};
    if (list->count == 0 || !isotherm_read_temperature_tick(&c, item)) return false;
    list->at = c.at;
    --list->count;
    return true;
}

static inline bool isotherm_read_temperature_batch(isotherm_cursor *c, isotherm_temperature_batch *o) {
    memset(o, 0, sizeof *o);
    if (!isotherm_get_count(c, 0u, 16u, &o->channels_count)) return false;
    for (uint32_t i = 0; i < o->channels_count; ++i) {
        if (!isotherm_get_text(c, 24u, &o->channels[i])) return false;
    }
    if (!isotherm_get_count(c, 1u, 4096u, &o->ticks.count)) return false;
    o->ticks.at = c->at;
    for (uint32_t i = 0; i < o->ticks.count; ++i) {
        isotherm_temperature_tick item;
        if (!isotherm_read_temperature_tick(c, &item)) return false;
    }
    o->ticks.end = c->at;
    return true;
}

static inline bool isotherm_read_health_reading(isotherm_cursor *c, isotherm_health_reading *o) {
    memset(o, 0, sizeof *o);
    if (!isotherm_get_text(c, 24u, &o->name)) return false;
    if (!isotherm_get_real(c, &o->value)) return false;
    return true;
}

static inline bool isotherm_next_health_reading(isotherm_list *list, isotherm_health_reading *item) {
    isotherm_cursor c = {list->at, list->end};
    if (list->count == 0 || !isotherm_read_health_reading(&c, item)) return false;
    list->at = c.at;
    --list->count;
    return true;
}

static inline bool isotherm_read_health_tick(isotherm_cursor *c, isotherm_health_tick *o) {
    memset(o, 0, sizeof *o);
    if (!isotherm_get_i64(c, &o->time_ns)) return false;
    if (!isotherm_get_count(c, 0u, 64u, &o->readings.count)) return false;
    o->readings.at = c->at;
    for (uint32_t i = 0; i < o->readings.count; ++i) {
        isotherm_health_reading item;
        if (!isotherm_read_health_reading(c, &item)) return false;
    }
    o->readings.end = c->at;
    return true;
}

static inline bool isotherm_next_health_tick(isotherm_list *list, isotherm_health_tick *item) {
    isotherm_cursor c = {list->at, list->end};
    if (list->count == 0 || !isotherm_read_health_tick(&c, item)) return false;
    list->at = c.at;
    --list->count;
    return true;
}

static inline bool isotherm_read_health_batch(isotherm_cursor *c, isotherm_health_batch *o) {
    memset(o, 0, sizeof *o);
    if (!isotherm_get_count(c, 1u, 4096u, &o->ticks.count)) return false;
    o->ticks.at = c->at;
    for (uint32_t i = 0; i < o->ticks.count; ++i) {
        isotherm_health_tick item;
        if (!isotherm_read_health_tick(c, &item)) return false;
    }
    o->ticks.end = c->at;
    return true;
}

static inline bool isotherm_read_rate_reference(isotherm_cursor *c, isotherm_rate_reference *o) {
    memset(o, 0, sizeof *o);
    if (!isotherm_get_i64(c, &o->start_ns)) return false;
    if (!isotherm_get_i64(c, &o->end_ns)) return false;
    for (uint32_t i = 0; i < 3; ++i) {
        if (!isotherm_get_real(c, &o->angular_rate_rad_per_s[i])) return false;
    }
    if (!isotherm_get_real(c, &o->sigma_rad_per_s)) return false;
    return true;
}

static inline bool isotherm_read_revision(isotherm_cursor *c, isotherm_revision *o) {
    memset(o, 0, sizeof *o);
    if (!isotherm_get_u64(c, &o->counter)) return false;
    if (!isotherm_get_bytes(c, 8, o->digest)) return false;
    return true;
}

static inline bool isotherm_read_applied_temperature(isotherm_cursor *c, isotherm_applied_temperature *o) {
    memset(o, 0, sizeof *o);
    if (!isotherm_get_text(c, 24u, &o->channel)) return false;
    if (!isotherm_get_real(c, &o->temperature_deg_c)) return false;
    if (!isotherm_get_real(c, &o->rate_deg_c_per_s)) return false;
    return true;
}

static inline bool isotherm_read_corrected_tick(isotherm_cursor *c, isotherm_corrected_tick *o) {
    memset(o, 0, sizeof *o);
    if (!isotherm_get_u64(c, &o->sequence)) return false;
    if (!isotherm_get_i64(c, &o->end_time_ns)) return false;
    if (!isotherm_get_u64(c, &o->duration_ns)) return false;
    if (!isotherm_get_u16(c, &o->ticks)) return false;
    if (!isotherm_get_u64(c, &o->missed)) return false;
    for (uint32_t i = 0; i < 3; ++i) {
        if (!isotherm_get_real(c, &o->delta_angle_rad[i])) return false;
    }
    for (uint32_t i = 0; i < 3; ++i) {
        if (!isotherm_get_real(c, &o->delta_velocity_m_per_s[i])) return false;
    }
    if (!isotherm_get_bool(c, &o->has_mode)) return false;
    if (o->has_mode) {
        if (!isotherm_read_mode(c, &o->mode)) return false;
    }
    if (!isotherm_get_u16(c, &o->flags)) return false;
    if (!isotherm_get_count(c, 0u, 8u, &o->gyro_flags_count)) return false;
    for (uint32_t i = 0; i < o->gyro_flags_count; ++i) {
        if (!isotherm_get_u8(c, &o->gyro_flags[i])) return false;
    }
    if (!isotherm_get_count(c, 0u, 8u, &o->accel_flags_count)) return false;
    for (uint32_t i = 0; i < o->accel_flags_count; ++i) {
        if (!isotherm_get_u8(c, &o->accel_flags[i])) return false;
    }
    if (!isotherm_get_count(c, 0u, 5u, &o->gyro_parity_rad_per_s_count)) return false;
    for (uint32_t i = 0; i < o->gyro_parity_rad_per_s_count; ++i) {
        if (!isotherm_get_real(c, &o->gyro_parity_rad_per_s[i])) return false;
    }
    if (!isotherm_get_count(c, 0u, 5u, &o->accel_parity_m_per_s2_count)) return false;
    for (uint32_t i = 0; i < o->accel_parity_m_per_s2_count; ++i) {
        if (!isotherm_get_real(c, &o->accel_parity_m_per_s2[i])) return false;
    }
    return true;
}

static inline bool isotherm_next_corrected_tick(isotherm_list *list, isotherm_corrected_tick *item) {
    isotherm_cursor c = {list->at, list->end};
    if (list->count == 0 || !isotherm_read_corrected_tick(&c, item)) return false;
    list->at = c.at;
    --list->count;
    return true;
}

static inline bool isotherm_read_corrected_batch(isotherm_cursor *c, isotherm_corrected_batch *o) {
    memset(o, 0, sizeof *o);
    if (!isotherm_get_text(c, 1048576u, &o->unit)) return false;
    if (!isotherm_read_revision(c, &o->revision)) return false;
    if (!isotherm_get_count(c, 0u, 16u, &o->temperatures_count)) return false;
    for (uint32_t i = 0; i < o->temperatures_count; ++i) {
        if (!isotherm_read_applied_temperature(c, &o->temperatures[i])) return false;
    }
    if (!isotherm_get_count(c, 1u, 4096u, &o->ticks.count)) return false;
    o->ticks.at = c->at;
    for (uint32_t i = 0; i < o->ticks.count; ++i) {
        isotherm_corrected_tick item;
        if (!isotherm_read_corrected_tick(c, &item)) return false;
    }
    o->ticks.end = c->at;
    return true;
}

static inline bool isotherm_read_sigma(isotherm_cursor *c, isotherm_sigma *o) {
    memset(o, 0, sizeof *o);
    if (!isotherm_get_u16(c, &o->from_tick)) return false;
    for (uint32_t i = 0; i < 3; ++i) {
        if (!isotherm_get_real(c, &o->angle_noise_rad[i])) return false;
    }
    for (uint32_t i = 0; i < 3; ++i) {
        if (!isotherm_get_real(c, &o->angle_restoration_rad[i])) return false;
    }
    for (uint32_t i = 0; i < 3; ++i) {
        if (!isotherm_get_real(c, &o->angle_calibration_rad[i])) return false;
    }
    for (uint32_t i = 0; i < 3; ++i) {
        if (!isotherm_get_real(c, &o->angle_clamping_rad[i])) return false;
    }
    for (uint32_t i = 0; i < 3; ++i) {
        if (!isotherm_get_real(c, &o->velocity_noise_m_per_s[i])) return false;
    }
    for (uint32_t i = 0; i < 3; ++i) {
        if (!isotherm_get_real(c, &o->velocity_restoration_m_per_s[i])) return false;
    }
    for (uint32_t i = 0; i < 3; ++i) {
        if (!isotherm_get_real(c, &o->velocity_calibration_m_per_s[i])) return false;
    }
    for (uint32_t i = 0; i < 3; ++i) {
        if (!isotherm_get_real(c, &o->velocity_clamping_m_per_s[i])) return false;
    }
    return true;
}

static inline bool isotherm_next_sigma(isotherm_list *list, isotherm_sigma *item) {
    isotherm_cursor c = {list->at, list->end};
    if (list->count == 0 || !isotherm_read_sigma(&c, item)) return false;
    list->at = c.at;
    --list->count;
    return true;
}

static inline bool isotherm_read_corrected_batch_2(isotherm_cursor *c, isotherm_corrected_batch_2 *o) {
    memset(o, 0, sizeof *o);
    if (!isotherm_get_text(c, 1048576u, &o->unit)) return false;
    if (!isotherm_read_revision(c, &o->revision)) return false;
    if (!isotherm_get_count(c, 0u, 16u, &o->temperatures_count)) return false;
    for (uint32_t i = 0; i < o->temperatures_count; ++i) {
        if (!isotherm_read_applied_temperature(c, &o->temperatures[i])) return false;
    }
    if (!isotherm_get_count(c, 1u, 4096u, &o->ticks.count)) return false;
    o->ticks.at = c->at;
    for (uint32_t i = 0; i < o->ticks.count; ++i) {
        isotherm_corrected_tick item;
        if (!isotherm_read_corrected_tick(c, &item)) return false;
    }
    o->ticks.end = c->at;
    if (!isotherm_get_count(c, 1u, 4096u, &o->sigmas.count)) return false;
    o->sigmas.at = c->at;
    for (uint32_t i = 0; i < o->sigmas.count; ++i) {
        isotherm_sigma item;
        if (!isotherm_read_sigma(c, &item)) return false;
    }
    o->sigmas.end = c->at;
    return true;
}

static inline bool isotherm_read_corrected_batch_3(isotherm_cursor *c, isotherm_corrected_batch_3 *o) {
    memset(o, 0, sizeof *o);
    if (!isotherm_get_text(c, 1048576u, &o->unit)) return false;
    if (!isotherm_get_u64(c, &o->series)) return false;
    if (!isotherm_read_revision(c, &o->revision)) return false;
    if (!isotherm_get_count(c, 0u, 16u, &o->temperatures_count)) return false;
    for (uint32_t i = 0; i < o->temperatures_count; ++i) {
        if (!isotherm_read_applied_temperature(c, &o->temperatures[i])) return false;
    }
    if (!isotherm_get_count(c, 1u, 4096u, &o->ticks.count)) return false;
    o->ticks.at = c->at;
    for (uint32_t i = 0; i < o->ticks.count; ++i) {
        isotherm_corrected_tick item;
        if (!isotherm_read_corrected_tick(c, &item)) return false;
    }
    o->ticks.end = c->at;
    if (!isotherm_get_count(c, 0u, 4096u, &o->sigmas.count)) return false;
    o->sigmas.at = c->at;
    for (uint32_t i = 0; i < o->sigmas.count; ++i) {
        isotherm_sigma item;
        if (!isotherm_read_sigma(c, &item)) return false;
    }
    o->sigmas.end = c->at;
    return true;
}

static inline bool isotherm_read_state(isotherm_cursor *c, isotherm_state *o) {
    uint32_t variant = 0;
    if (!isotherm_get_u32(c, &variant) || variant >= 5u) return false;
    *o = (isotherm_state)variant;
    return true;
}

static inline bool isotherm_read_output(isotherm_cursor *c, isotherm_output *o) {
    uint32_t variant = 0;
    if (!isotherm_get_u32(c, &variant) || variant >= 3u) return false;
    *o = (isotherm_output)variant;
    return true;
}

static inline bool isotherm_read_active_calibration(isotherm_cursor *c, isotherm_active_calibration *o) {
    memset(o, 0, sizeof *o);
    if (!isotherm_read_revision(c, &o->revision)) return false;
    if (!isotherm_get_bool(c, &o->has_digest)) return false;
    if (o->has_digest) {
        if (!isotherm_get_bytes(c, 32, o->digest)) return false;
    }
    if (!isotherm_get_bool(c, &o->has_created_unix_s)) return false;
    if (o->has_created_unix_s) {
        if (!isotherm_get_i64(c, &o->created_unix_s)) return false;
    }
    if (!isotherm_get_bool(c, &o->has_age_s)) return false;
    if (o->has_age_s) {
        if (!isotherm_get_i64(c, &o->age_s)) return false;
    }
    if (!isotherm_get_text(c, 1048576u, &o->source)) return false;
    if (!isotherm_get_bool(c, &o->has_overlay)) return false;
    if (o->has_overlay) {
        if (!isotherm_get_bytes(c, 32, o->overlay)) return false;
    }
    return true;
}

static inline bool isotherm_read_schedule(isotherm_cursor *c, isotherm_schedule *o) {
    uint32_t variant = 0;
    if (!isotherm_get_u32(c, &variant) || variant >= 3u) return false;
    memset(o, 0, sizeof *o);
    o->variant = (isotherm_schedule_variant)variant;
    if (variant == 1u) {
        if (!isotherm_get_u64(c, &o->sequence)) return false;
    }
    if (variant == 2u) {
        if (!isotherm_get_i64(c, &o->time_ns)) return false;
    }
    return true;
}

static inline bool isotherm_read_pending_change(isotherm_cursor *c, isotherm_pending_change *o) {
    memset(o, 0, sizeof *o);
    if (!isotherm_read_revision(c, &o->revision)) return false;
    if (!isotherm_get_bool(c, &o->has_digest)) return false;
    if (o->has_digest) {
        if (!isotherm_get_bytes(c, 32, o->digest)) return false;
    }
    if (!isotherm_get_text(c, 1048576u, &o->source)) return false;
    if (!isotherm_read_schedule(c, &o->schedule)) return false;
    if (!isotherm_get_real(c, &o->slew_s)) return false;
    return true;
}

static inline bool isotherm_read_swaps(isotherm_cursor *c, isotherm_swaps *o) {
    memset(o, 0, sizeof *o);
    if (!isotherm_get_u64(c, &o->accepted)) return false;
    if (!isotherm_get_u64(c, &o->refused)) return false;
    if (!isotherm_get_bool(c, &o->has_last_refusal)) return false;
    if (o->has_last_refusal) {
        if (!isotherm_get_text(c, 1048576u, &o->last_refusal)) return false;
    }
    return true;
}

static inline bool isotherm_read_last_tick(isotherm_cursor *c, isotherm_last_tick *o) {
    memset(o, 0, sizeof *o);
    if (!isotherm_get_i64(c, &o->end_time_ns)) return false;
    if (!isotherm_get_u64(c, &o->sequence)) return false;
    if (!isotherm_get_u64(c, &o->series)) return false;
    return true;
}

static inline bool isotherm_read_place(isotherm_cursor *c, isotherm_place *o) {
    uint32_t variant = 0;
    if (!isotherm_get_u32(c, &variant) || variant >= 3u) return false;
    *o = (isotherm_place)variant;
    return true;
}

static inline bool isotherm_read_channel_status(isotherm_cursor *c, isotherm_channel_status *o) {
    memset(o, 0, sizeof *o);
    if (!isotherm_get_text(c, 24u, &o->name)) return false;
    if (!isotherm_get_bool(c, &o->has_temperature_deg_c)) return false;
    if (o->has_temperature_deg_c) {
        if (!isotherm_get_real(c, &o->temperature_deg_c)) return false;
    }
    if (!isotherm_get_bool(c, &o->has_rate_deg_c_per_s)) return false;
    if (o->has_rate_deg_c_per_s) {
        if (!isotherm_get_real(c, &o->rate_deg_c_per_s)) return false;
    }
    if (!isotherm_get_bool(c, &o->stale)) return false;
    if (!isotherm_get_bool(c, &o->warming_up)) return false;
    if (!isotherm_get_bool(c, &o->has_calibrated_range_deg_c)) return false;
    if (o->has_calibrated_range_deg_c) {
        for (uint32_t i = 0; i < 2; ++i) {
            if (!isotherm_get_real(c, &o->calibrated_range_deg_c[i])) return false;
        }
    }
    if (!isotherm_get_bool(c, &o->has_place)) return false;
    if (o->has_place) {
        if (!isotherm_read_place(c, &o->place)) return false;
    }
    return true;
}

static inline bool isotherm_next_channel_status(isotherm_list *list, isotherm_channel_status *item) {
    isotherm_cursor c = {list->at, list->end};
    if (list->count == 0 || !isotherm_read_channel_status(&c, item)) return false;
    list->at = c.at;
    --list->count;
    return true;
}

static inline bool isotherm_read_sensor_kind(isotherm_cursor *c, isotherm_sensor_kind *o) {
    uint32_t variant = 0;
    if (!isotherm_get_u32(c, &variant) || variant >= 2u) return false;
    *o = (isotherm_sensor_kind)variant;
    return true;
}

static inline bool isotherm_read_sensor_status(isotherm_cursor *c, isotherm_sensor_status *o) {
    memset(o, 0, sizeof *o);
    if (!isotherm_get_text(c, 1048576u, &o->name)) return false;
    if (!isotherm_read_sensor_kind(c, &o->kind)) return false;
    if (!isotherm_get_u8(c, &o->flags)) return false;
    if (!isotherm_get_u64(c, &o->ticks)) return false;
    if (!isotherm_get_u64(c, &o->invalid)) return false;
    if (!isotherm_get_u64(c, &o->overrange)) return false;
    if (!isotherm_get_u64(c, &o->not_finite)) return false;
    if (!isotherm_get_u64(c, &o->clamped)) return false;
    if (!isotherm_get_u64(c, &o->stale)) return false;
    if (!isotherm_get_u64(c, &o->excluded)) return false;
    return true;
}

static inline bool isotherm_next_sensor_status(isotherm_list *list, isotherm_sensor_status *item) {
    isotherm_cursor c = {list->at, list->end};
    if (list->count == 0 || !isotherm_read_sensor_status(&c, item)) return false;
    list->at = c.at;
    --list->count;
    return true;
}

static inline bool isotherm_read_input_rates(isotherm_cursor *c, isotherm_input_rates *o) {
    memset(o, 0, sizeof *o);
    if (!isotherm_get_real(c, &o->gyro_ticks_per_s)) return false;
    if (!isotherm_get_real(c, &o->accel_ticks_per_s)) return false;
    if (!isotherm_get_real(c, &o->temperature_readings_per_s)) return false;
    if (!isotherm_get_real(c, &o->messages_per_s)) return false;
    return true;
}

static inline bool isotherm_read_applied_correction(isotherm_cursor *c, isotherm_applied_correction *o) {
    memset(o, 0, sizeof *o);
    for (uint32_t i = 0; i < 3; ++i) {
        if (!isotherm_get_real(c, &o->angular_rate_rad_per_s[i])) return false;
    }
    for (uint32_t i = 0; i < 3; ++i) {
        if (!isotherm_get_real(c, &o->specific_force_m_per_s2[i])) return false;
    }
    return true;
}

static inline bool isotherm_read_drift_status(isotherm_cursor *c, isotherm_drift_status *o) {
    memset(o, 0, sizeof *o);
    if (!isotherm_get_text(c, 1048576u, &o->gyro)) return false;
    if (!isotherm_get_real(c, &o->rate_rad_per_s)) return false;
    if (!isotherm_get_real(c, &o->sigma_rad_per_s)) return false;
    if (!isotherm_get_real(c, &o->trend_rad_per_s2)) return false;
    if (!isotherm_get_u64(c, &o->updates)) return false;
    if (!isotherm_get_u64(c, &o->refused)) return false;
    if (!isotherm_get_bool(c, &o->has_mean_nis)) return false;
    if (o->has_mean_nis) {
        if (!isotherm_get_real(c, &o->mean_nis)) return false;
    }
    if (!isotherm_get_bool(c, &o->has_last_update_ns)) return false;
    if (o->has_last_update_ns) {
        if (!isotherm_get_i64(c, &o->last_update_ns)) return false;
    }
    if (!isotherm_get_bool(c, &o->subtracted)) return false;
    return true;
}

static inline bool isotherm_next_drift_status(isotherm_list *list, isotherm_drift_status *item) {
    isotherm_cursor c = {list->at, list->end};
    if (list->count == 0 || !isotherm_read_drift_status(&c, item)) return false;
    list->at = c.at;
    --list->count;
    return true;
}

static inline bool isotherm_read_rest(isotherm_cursor *c, isotherm_rest *o) {
    uint32_t variant = 0;
    if (!isotherm_get_u32(c, &variant) || variant >= 3u) return false;
    memset(o, 0, sizeof *o);
    o->variant = (isotherm_rest_variant)variant;
    if (variant == 2u) {
        if (!isotherm_get_text(c, 1048576u, &o->moved)) return false;
    }
    return true;
}

static inline bool isotherm_read_self_test_item(isotherm_cursor *c, isotherm_self_test_item *o) {
    memset(o, 0, sizeof *o);
    if (!isotherm_get_text(c, 1048576u, &o->name)) return false;
    if (!isotherm_get_bool(c, &o->has_value)) return false;
    if (o->has_value) {
        if (!isotherm_get_real(c, &o->value)) return false;
    }
    if (!isotherm_get_bool(c, &o->has_at_least)) return false;
    if (o->has_at_least) {
        if (!isotherm_get_real(c, &o->at_least)) return false;
    }
    if (!isotherm_get_bool(c, &o->has_at_most)) return false;
    if (o->has_at_most) {
        if (!isotherm_get_real(c, &o->at_most)) return false;
    }
    if (!isotherm_get_text(c, 1048576u, &o->unit_of_measure)) return false;
    if (!isotherm_get_bool(c, &o->passed)) return false;
    return true;
}

static inline bool isotherm_next_self_test_item(isotherm_list *list, isotherm_self_test_item *item) {
    isotherm_cursor c = {list->at, list->end};
    if (list->count == 0 || !isotherm_read_self_test_item(&c, item)) return false;
    list->at = c.at;
    --list->count;
    return true;
}

static inline bool isotherm_read_self_test_report(isotherm_cursor *c, isotherm_self_test_report *o) {
    memset(o, 0, sizeof *o);
    if (!isotherm_get_bool(c, &o->passed)) return false;
    if (!isotherm_get_bool(c, &o->has_ended_ns)) return false;
    if (o->has_ended_ns) {
        if (!isotherm_get_i64(c, &o->ended_ns)) return false;
    }
    if (!isotherm_get_real(c, &o->length_s)) return false;
    if (!isotherm_get_count(c, 0u, 256u, &o->items.count)) return false;
    o->items.at = c->at;
    for (uint32_t i = 0; i < o->items.count; ++i) {
        isotherm_self_test_item item;
        if (!isotherm_read_self_test_item(c, &item)) return false;
    }
    o->items.end = c->at;
    return true;
}

static inline bool isotherm_read_pre_launch_mode(isotherm_cursor *c, isotherm_pre_launch_mode *o) {
    memset(o, 0, sizeof *o);
    if (!isotherm_get_bool(c, &o->has_mode)) return false;
    if (o->has_mode) {
        if (!isotherm_read_mode(c, &o->mode)) return false;
    }
    if (!isotherm_get_u64(c, &o->ticks)) return false;
    if (!isotherm_get_real(c, &o->time_s)) return false;
    if (!isotherm_get_bool(c, &o->has_mean_temperature_deg_c)) return false;
    if (o->has_mean_temperature_deg_c) {
        if (!isotherm_get_real(c, &o->mean_temperature_deg_c)) return false;
    }
    return true;
}

static inline bool isotherm_next_pre_launch_mode(isotherm_list *list, isotherm_pre_launch_mode *item) {
    isotherm_cursor c = {list->at, list->end};
    if (list->count == 0 || !isotherm_read_pre_launch_mode(&c, item)) return false;
    list->at = c.at;
    --list->count;
    return true;
}

static inline bool isotherm_read_pre_launch_gyro(isotherm_cursor *c, isotherm_pre_launch_gyro *o) {
    memset(o, 0, sizeof *o);
    if (!isotherm_get_text(c, 1048576u, &o->name)) return false;
    if (!isotherm_get_count(c, 0u, 3u, &o->modes.count)) return false;
    o->modes.at = c->at;
    for (uint32_t i = 0; i < o->modes.count; ++i) {
        isotherm_pre_launch_mode item;
        if (!isotherm_read_pre_launch_mode(c, &item)) return false;
    }
    o->modes.end = c->at;
    if (!isotherm_get_bool(c, &o->has_sigma_rad_per_s)) return false;
    if (o->has_sigma_rad_per_s) {
        if (!isotherm_get_real(c, &o->sigma_rad_per_s)) return false;
    }
    return true;
}

static inline bool isotherm_next_pre_launch_gyro(isotherm_list *list, isotherm_pre_launch_gyro *item) {
    isotherm_cursor c = {list->at, list->end};
    if (list->count == 0 || !isotherm_read_pre_launch_gyro(&c, item)) return false;
    list->at = c.at;
    --list->count;
    return true;
}

static inline bool isotherm_read_pre_launch_progress(isotherm_cursor *c, isotherm_pre_launch_progress *o) {
    memset(o, 0, sizeof *o);
    if (!isotherm_get_real(c, &o->elapsed_s)) return false;
    if (!isotherm_get_real(c, &o->duration_s)) return false;
    if (!isotherm_get_count(c, 0u, 8u, &o->gyros.count)) return false;
    o->gyros.at = c->at;
    for (uint32_t i = 0; i < o->gyros.count; ++i) {
        isotherm_pre_launch_gyro item;
        if (!isotherm_read_pre_launch_gyro(c, &item)) return false;
    }
    o->gyros.end = c->at;
    return true;
}

static inline bool isotherm_read_constants_change(isotherm_cursor *c, isotherm_constants_change *o) {
    memset(o, 0, sizeof *o);
    if (!isotherm_get_text(c, 1048576u, &o->gyro)) return false;
    if (!isotherm_get_real(c, &o->static_bias_change_rad_per_s)) return false;
    if (!isotherm_get_real(c, &o->static_bias_sigma_rad_per_s)) return false;
    if (!isotherm_get_bool(c, &o->has_magnetic_bias_change_rad_per_s)) return false;
    if (o->has_magnetic_bias_change_rad_per_s) {
        if (!isotherm_get_real(c, &o->magnetic_bias_change_rad_per_s)) return false;
    }
    if (!isotherm_get_bool(c, &o->has_magnetic_bias_sigma_rad_per_s)) return false;
    if (o->has_magnetic_bias_sigma_rad_per_s) {
        if (!isotherm_get_real(c, &o->magnetic_bias_sigma_rad_per_s)) return false;
    }
    if (!isotherm_get_real(c, &o->earth_rate_rad_per_s)) return false;
    if (!isotherm_get_count(c, 0u, 3u, &o->modes.count)) return false;
    o->modes.at = c->at;
    for (uint32_t i = 0; i < o->modes.count; ++i) {
        isotherm_pre_launch_mode item;
        if (!isotherm_read_pre_launch_mode(c, &item)) return false;
    }
    o->modes.end = c->at;
    return true;
}

static inline bool isotherm_next_constants_change(isotherm_list *list, isotherm_constants_change *item) {
    isotherm_cursor c = {list->at, list->end};
    if (list->count == 0 || !isotherm_read_constants_change(&c, item)) return false;
    list->at = c.at;
    --list->count;
    return true;
}

static inline bool isotherm_read_verdict(isotherm_cursor *c, isotherm_verdict *o) {
    uint32_t variant = 0;
    if (!isotherm_get_u32(c, &variant) || variant >= 3u) return false;
    memset(o, 0, sizeof *o);
    o->variant = (isotherm_verdict_variant)variant;
    if (variant == 0u) {
        if (!isotherm_get_count(c, 0u, 8u, &o->accepted.count)) return false;
        o->accepted.at = c->at;
        for (uint32_t i = 0; i < o->accepted.count; ++i) {
            isotherm_constants_change item;
            if (!isotherm_read_constants_change(c, &item)) return false;
        }
        o->accepted.end = c->at;
    }
    if (variant == 1u) {
        if (!isotherm_get_count(c, 0u, 64u, &o->refused.count)) return false;
        o->refused.at = c->at;
        for (uint32_t i = 0; i < o->refused.count; ++i) {
            isotherm_view item;
            if (!isotherm_get_text(c, 1048576u, &item)) return false;
        }
        o->refused.end = c->at;
    }
    return true;
}

static inline bool isotherm_read_pre_launch_outcome(isotherm_cursor *c, isotherm_pre_launch_outcome *o) {
    memset(o, 0, sizeof *o);
    if (!isotherm_get_bool(c, &o->has_ended_ns)) return false;
    if (o->has_ended_ns) {
        if (!isotherm_get_i64(c, &o->ended_ns)) return false;
    }
    if (!isotherm_read_verdict(c, &o->verdict)) return false;
    if (!isotherm_get_bool(c, &o->has_overlay)) return false;
    if (o->has_overlay) {
        if (!isotherm_get_bytes(c, 32, o->overlay)) return false;
    }
    return true;
}

static inline bool isotherm_read_counter(isotherm_cursor *c, isotherm_counter *o) {
    memset(o, 0, sizeof *o);
    if (!isotherm_get_text(c, 1048576u, &o->name)) return false;
    if (!isotherm_get_u64(c, &o->value)) return false;
    return true;
}

static inline bool isotherm_next_counter(isotherm_list *list, isotherm_counter *item) {
    isotherm_cursor c = {list->at, list->end};
    if (list->count == 0 || !isotherm_read_counter(&c, item)) return false;
    list->at = c.at;
    --list->count;
    return true;
}

static inline bool isotherm_read_fault(isotherm_cursor *c, isotherm_fault *o) {
    memset(o, 0, sizeof *o);
    if (!isotherm_get_text(c, 1048576u, &o->kind)) return false;
    if (!isotherm_get_u64(c, &o->count)) return false;
    if (!isotherm_get_text(c, 1048576u, &o->first)) return false;
    if (!isotherm_get_i64(c, &o->last_unix_ms)) return false;
    return true;
}

static inline bool isotherm_next_fault(isotherm_list *list, isotherm_fault *item) {
    isotherm_cursor c = {list->at, list->end};
    if (list->count == 0 || !isotherm_read_fault(&c, item)) return false;
    list->at = c.at;
    --list->count;
    return true;
}

static inline bool isotherm_read_latency_bucket(isotherm_cursor *c, isotherm_latency_bucket *o) {
    memset(o, 0, sizeof *o);
    if (!isotherm_get_u64(c, &o->up_to_ns)) return false;
    if (!isotherm_get_u64(c, &o->count)) return false;
    return true;
}

static inline bool isotherm_next_latency_bucket(isotherm_list *list, isotherm_latency_bucket *item) {
    isotherm_cursor c = {list->at, list->end};
    if (list->count == 0 || !isotherm_read_latency_bucket(&c, item)) return false;
    list->at = c.at;
    --list->count;
    return true;
}

static inline bool isotherm_read_latency(isotherm_cursor *c, isotherm_latency *o) {
    memset(o, 0, sizeof *o);
    if (!isotherm_get_u64(c, &o->p50_ns)) return false;
    if (!isotherm_get_u64(c, &o->p99_ns)) return false;
    if (!isotherm_get_u64(c, &o->p999_ns)) return false;
    if (!isotherm_get_u64(c, &o->max_ns)) return false;
    if (!isotherm_get_count(c, 0u, 1024u, &o->buckets.count)) return false;
    o->buckets.at = c->at;
    for (uint32_t i = 0; i < o->buckets.count; ++i) {
        isotherm_latency_bucket item;
        if (!isotherm_read_latency_bucket(c, &item)) return false;
    }
    o->buckets.end = c->at;
    return true;
}

static inline bool isotherm_read_status(isotherm_cursor *c, isotherm_status *o) {
    memset(o, 0, sizeof *o);
    if (!isotherm_get_text(c, 1048576u, &o->unit)) return false;
    if (!isotherm_get_text(c, 1048576u, &o->instance)) return false;
    if (!isotherm_get_text(c, 1048576u, &o->version)) return false;
    if (!isotherm_read_state(c, &o->state)) return false;
    if (!isotherm_read_output(c, &o->output)) return false;
    if (!isotherm_get_bool(c, &o->has_calibration)) return false;
    if (o->has_calibration) {
        if (!isotherm_read_active_calibration(c, &o->calibration)) return false;
    }
    if (!isotherm_get_bool(c, &o->has_pending)) return false;
    if (o->has_pending) {
        if (!isotherm_read_pending_change(c, &o->pending)) return false;
    }
    if (!isotherm_read_swaps(c, &o->swaps)) return false;
    if (!isotherm_get_bool(c, &o->has_last_tick)) return false;
    if (o->has_last_tick) {
        if (!isotherm_read_last_tick(c, &o->last_tick)) return false;
    }
    if (!isotherm_get_count(c, 0u, 256u, &o->channels.count)) return false;
    o->channels.at = c->at;
    for (uint32_t i = 0; i < o->channels.count; ++i) {
        isotherm_channel_status item;
        if (!isotherm_read_channel_status(c, &item)) return false;
    }
    o->channels.end = c->at;
    if (!isotherm_get_count(c, 0u, 16u, &o->sensors.count)) return false;
    o->sensors.at = c->at;
    for (uint32_t i = 0; i < o->sensors.count; ++i) {
        isotherm_sensor_status item;
        if (!isotherm_read_sensor_status(c, &item)) return false;
    }
    o->sensors.end = c->at;
    if (!isotherm_read_input_rates(c, &o->input_rates)) return false;
    if (!isotherm_get_bool(c, &o->has_applied)) return false;
    if (o->has_applied) {
        if (!isotherm_read_applied_correction(c, &o->applied)) return false;
    }
    if (!isotherm_get_count(c, 0u, 16u, &o->drift.count)) return false;
    o->drift.at = c->at;
    for (uint32_t i = 0; i < o->drift.count; ++i) {
        isotherm_drift_status item;
        if (!isotherm_read_drift_status(c, &item)) return false;
    }
    o->drift.end = c->at;
    if (!isotherm_get_bool(c, &o->has_rest)) return false;
    if (o->has_rest) {
        if (!isotherm_read_rest(c, &o->rest)) return false;
    }
    if (!isotherm_get_bool(c, &o->has_self_test)) return false;
    if (o->has_self_test) {
        if (!isotherm_read_self_test_report(c, &o->self_test)) return false;
    }
    if (!isotherm_get_bool(c, &o->has_pre_launch)) return false;
    if (o->has_pre_launch) {
        if (!isotherm_read_pre_launch_progress(c, &o->pre_launch)) return false;
    }
    if (!isotherm_get_bool(c, &o->has_pre_launch_outcome)) return false;
    if (o->has_pre_launch_outcome) {
        if (!isotherm_read_pre_launch_outcome(c, &o->pre_launch_outcome)) return false;
    }
    if (!isotherm_get_count(c, 0u, 256u, &o->counters.count)) return false;
    o->counters.at = c->at;
    for (uint32_t i = 0; i < o->counters.count; ++i) {
        isotherm_counter item;
        if (!isotherm_read_counter(c, &item)) return false;
    }
    o->counters.end = c->at;
    if (!isotherm_get_count(c, 0u, 32u, &o->faults.count)) return false;
    o->faults.at = c->at;
    for (uint32_t i = 0; i < o->faults.count; ++i) {
        isotherm_fault item;
        if (!isotherm_read_fault(c, &item)) return false;
    }
    o->faults.end = c->at;
    if (!isotherm_get_bool(c, &o->has_last_fault)) return false;
    if (o->has_last_fault) {
        if (!isotherm_get_text(c, 1048576u, &o->last_fault)) return false;
    }
    if (!isotherm_read_latency(c, &o->latency)) return false;
    return true;
}

static inline bool isotherm_read_state_1(isotherm_cursor *c, isotherm_state_1 *o) {
    uint32_t variant = 0;
    if (!isotherm_get_u32(c, &variant) || variant >= 3u) return false;
    *o = (isotherm_state_1)variant;
    return true;
}

static inline bool isotherm_read_channel_status_1(isotherm_cursor *c, isotherm_channel_status_1 *o) {
    memset(o, 0, sizeof *o);
    if (!isotherm_get_text(c, 24u, &o->channel)) return false;
    if (!isotherm_get_bool(c, &o->has_temperature_deg_c)) return false;
    if (o->has_temperature_deg_c) {
        if (!isotherm_get_real(c, &o->temperature_deg_c)) return false;
    }
    if (!isotherm_get_bool(c, &o->has_rate_deg_c_per_s)) return false;
    if (o->has_rate_deg_c_per_s) {
        if (!isotherm_get_real(c, &o->rate_deg_c_per_s)) return false;
    }
    if (!isotherm_get_bool(c, &o->stale)) return false;
    if (!isotherm_get_bool(c, &o->warming_up)) return false;
    return true;
}

static inline bool isotherm_next_channel_status_1(isotherm_list *list, isotherm_channel_status_1 *item) {
    isotherm_cursor c = {list->at, list->end};
    if (list->count == 0 || !isotherm_read_channel_status_1(&c, item)) return false;
    list->at = c.at;
    --list->count;
    return true;
}

static inline bool isotherm_read_status_1(isotherm_cursor *c, isotherm_status_1 *o) {
    memset(o, 0, sizeof *o);
    if (!isotherm_get_text(c, 1048576u, &o->unit)) return false;
    if (!isotherm_get_text(c, 1048576u, &o->service_version)) return false;
    if (!isotherm_read_state_1(c, &o->state)) return false;
    if (!isotherm_read_revision(c, &o->revision)) return false;
    if (!isotherm_get_bool(c, &o->has_last_end_time_ns)) return false;
    if (o->has_last_end_time_ns) {
        if (!isotherm_get_i64(c, &o->last_end_time_ns)) return false;
    }
    if (!isotherm_get_bool(c, &o->has_last_sequence)) return false;
    if (o->has_last_sequence) {
        if (!isotherm_get_u64(c, &o->last_sequence)) return false;
    }
    if (!isotherm_get_count(c, 0u, 256u, &o->channels.count)) return false;
    o->channels.at = c->at;
    for (uint32_t i = 0; i < o->channels.count; ++i) {
        isotherm_channel_status_1 item;
        if (!isotherm_read_channel_status_1(c, &item)) return false;
    }
    o->channels.end = c->at;
    if (!isotherm_get_count(c, 0u, 256u, &o->counters.count)) return false;
    o->counters.at = c->at;
    for (uint32_t i = 0; i < o->counters.count; ++i) {
        isotherm_counter item;
        if (!isotherm_read_counter(c, &item)) return false;
    }
    o->counters.end = c->at;
    if (!isotherm_get_bool(c, &o->has_last_fault)) return false;
    if (o->has_last_fault) {
        if (!isotherm_get_text(c, 1048576u, &o->last_fault)) return false;
    }
    if (!isotherm_get_u64(c, &o->added_latency_p50_ns)) return false;
    if (!isotherm_get_u64(c, &o->added_latency_p99_ns)) return false;
    return true;
}

static inline bool isotherm_read_unit_summary(isotherm_cursor *c, isotherm_unit_summary *o) {
    memset(o, 0, sizeof *o);
    if (!isotherm_get_text(c, 1048576u, &o->unit)) return false;
    if (!isotherm_read_state(c, &o->state)) return false;
    if (!isotherm_read_output(c, &o->output)) return false;
    return true;
}

static inline bool isotherm_next_unit_summary(isotherm_list *list, isotherm_unit_summary *item) {
    isotherm_cursor c = {list->at, list->end};
    if (list->count == 0 || !isotherm_read_unit_summary(&c, item)) return false;
    list->at = c.at;
    --list->count;
    return true;
}

static inline bool isotherm_read_folder_state(isotherm_cursor *c, isotherm_folder_state *o) {
    uint32_t variant = 0;
    if (!isotherm_get_u32(c, &variant) || variant >= 3u) return false;
    *o = (isotherm_folder_state)variant;
    return true;
}

static inline bool isotherm_read_folder_status(isotherm_cursor *c, isotherm_folder_status *o) {
    memset(o, 0, sizeof *o);
    if (!isotherm_get_text(c, 1048576u, &o->path)) return false;
    if (!isotherm_read_folder_state(c, &o->state)) return false;
    if (!isotherm_get_bool(c, &o->has_reason)) return false;
    if (o->has_reason) {
        if (!isotherm_get_text(c, 1048576u, &o->reason)) return false;
    }
    return true;
}

static inline bool isotherm_read_bad_document(isotherm_cursor *c, isotherm_bad_document *o) {
    memset(o, 0, sizeof *o);
    if (!isotherm_get_text(c, 1048576u, &o->file)) return false;
    if (!isotherm_get_text(c, 1048576u, &o->problem)) return false;
    if (!isotherm_get_u64(c, &o->problems)) return false;
    return true;
}

static inline bool isotherm_next_bad_document(isotherm_list *list, isotherm_bad_document *item) {
    isotherm_cursor c = {list->at, list->end};
    if (list->count == 0 || !isotherm_read_bad_document(&c, item)) return false;
    list->at = c.at;
    --list->count;
    return true;
}

static inline bool isotherm_read_store_status(isotherm_cursor *c, isotherm_store_status *o) {
    memset(o, 0, sizeof *o);
    if (!isotherm_get_text(c, 1048576u, &o->path)) return false;
    if (!isotherm_get_u64(c, &o->audit_entries)) return false;
    return true;
}

static inline bool isotherm_read_service_status(isotherm_cursor *c, isotherm_service_status *o) {
    memset(o, 0, sizeof *o);
    if (!isotherm_get_text(c, 1048576u, &o->instance)) return false;
    if (!isotherm_get_text(c, 1048576u, &o->version)) return false;
    if (!isotherm_get_bool(c, &o->has_pid)) return false;
    if (o->has_pid) {
        if (!isotherm_get_u32(c, &o->pid)) return false;
    }
    if (!isotherm_get_i64(c, &o->started_unix_ms)) return false;
    if (!isotherm_get_real(c, &o->uptime_s)) return false;
    if (!isotherm_get_count(c, 0u, 4096u, &o->units.count)) return false;
    o->units.at = c->at;
    for (uint32_t i = 0; i < o->units.count; ++i) {
        isotherm_unit_summary item;
        if (!isotherm_read_unit_summary(c, &item)) return false;
    }
    o->units.end = c->at;
    if (!isotherm_get_bool(c, &o->has_calibrations)) return false;
    if (o->has_calibrations) {
        if (!isotherm_read_folder_status(c, &o->calibrations)) return false;
    }
    if (!isotherm_get_count(c, 0u, 64u, &o->bad_documents.count)) return false;
    o->bad_documents.at = c->at;
    for (uint32_t i = 0; i < o->bad_documents.count; ++i) {
        isotherm_bad_document item;
        if (!isotherm_read_bad_document(c, &item)) return false;
    }
    o->bad_documents.end = c->at;
    if (!isotherm_get_bool(c, &o->has_store)) return false;
    if (o->has_store) {
        if (!isotherm_read_store_status(c, &o->store)) return false;
    }
    if (!isotherm_get_count(c, 0u, 32u, &o->faults.count)) return false;
    o->faults.at = c->at;
    for (uint32_t i = 0; i < o->faults.count; ++i) {
        isotherm_fault item;
        if (!isotherm_read_fault(c, &item)) return false;
    }
    o->faults.end = c->at;
    if (!isotherm_get_bool(c, &o->has_settings_digest)) return false;
    if (o->has_settings_digest) {
        if (!isotherm_get_bytes(c, 32, o->settings_digest)) return false;
    }
    if (!isotherm_get_u64(c, &o->swaps_accepted)) return false;
    if (!isotherm_get_u64(c, &o->swaps_refused)) return false;
    return true;
}

static inline bool isotherm_read_journal_part(isotherm_cursor *c, isotherm_journal_part *o) {
    memset(o, 0, sizeof *o);
    if (!isotherm_get_text(c, 1048576u, &o->unit)) return false;
    if (!isotherm_get_text(c, 1048576u, &o->instance)) return false;
    if (!isotherm_get_u64(c, &o->number)) return false;
    if (!isotherm_get_u32(c, &o->part)) return false;
    if (!isotherm_get_u32(c, &o->parts)) return false;
    if (!isotherm_get_view(c, 1u, 524288u, &o->bytes)) return false;
    return true;
}

static inline void isotherm_write_readings(isotherm_writer *w, const isotherm_readings *v) {
    isotherm_put_variant(w, 2u, (uint32_t)v->variant);
    if ((uint32_t)v->variant == 0u) {
        isotherm_put_count(w, 8u, v->counts_count);
        for (uint32_t i = 0; i < v->counts_count && w->ok; ++i) {
            isotherm_put_i32(w, v->counts[i]);
        }
    }
    if ((uint32_t)v->variant == 1u) {
        isotherm_put_count(w, 8u, v->means_count);
        for (uint32_t i = 0; i < v->means_count && w->ok; ++i) {
            isotherm_put_real(w, v->means[i]);
        }
    }
}

static inline void isotherm_write_mode(isotherm_writer *w, const isotherm_mode *v) {
    isotherm_put_variant(w, 2u, (uint32_t)*v);
}

static inline void isotherm_write_half_period(isotherm_writer *w, const isotherm_half_period *v) {
    isotherm_put_i32(w, v->positive);
    isotherm_put_i32(w, v->negative);
}

static inline void isotherm_write_gyro_tick(isotherm_writer *w, const isotherm_gyro_tick *v) {
    isotherm_put_i64(w, v->end_time_ns);
    isotherm_put_u64(w, v->duration_ns);
    isotherm_write_readings(w, &v->readings);
    isotherm_put_bool(w, v->has_mode);
    if (v->has_mode) {
        isotherm_write_mode(w, &v->mode);
    }
    isotherm_put_bool(w, v->switch_command);
    isotherm_put_bool(w, v->has_meander);
    if (v->has_meander) {
        isotherm_write_mode(w, &v->meander);
    }
    isotherm_put_count(w, 8u, v->half_periods_count);
    for (uint32_t i = 0; i < v->half_periods_count && w->ok; ++i) {
        isotherm_write_half_period(w, &v->half_periods[i]);
    }
}

static inline void isotherm_write_accelerometer_tick(isotherm_writer *w, const isotherm_accelerometer_tick *v) {
    isotherm_put_i64(w, v->end_time_ns);
    isotherm_put_u64(w, v->duration_ns);
    isotherm_write_readings(w, &v->readings);
}

static inline void isotherm_write_temperature_tick(isotherm_writer *w, const isotherm_temperature_tick *v) {
    isotherm_put_i64(w, v->time_ns);
    isotherm_put_count(w, 16u, v->raw_count);
    for (uint32_t i = 0; i < v->raw_count && w->ok; ++i) {
        isotherm_put_real(w, v->raw[i]);
    }
}

static inline void isotherm_write_health_reading(isotherm_writer *w, const isotherm_health_reading *v) {
    isotherm_put_text(w, 24u, v->name);
    isotherm_put_real(w, v->value);
}

static inline void isotherm_write_rate_reference(isotherm_writer *w, const isotherm_rate_reference *v) {
    isotherm_put_i64(w, v->start_ns);
    isotherm_put_i64(w, v->end_ns);
    for (uint32_t i = 0; i < 3; ++i) {
        isotherm_put_real(w, v->angular_rate_rad_per_s[i]);
    }
    isotherm_put_real(w, v->sigma_rad_per_s);
}
/* generated: end of types */

/* What the types cannot say. */

static inline bool isotherm_is_alike(const isotherm_readings *first, const isotherm_readings *readings, uint32_t halves) {
    const uint32_t count = readings->counts_count + readings->means_count;
    return readings->variant == first->variant && count == first->counts_count + first->means_count
        && (halves == 0 || halves == count);
}

static inline bool isotherm_rule_alike_gyro_batch(const isotherm_gyro_batch *batch) {
    isotherm_list ticks = batch->ticks;
    isotherm_readings first = {ISOTHERM_READINGS_COUNTS, 0, {0}, 0, {0}};
    isotherm_gyro_tick tick;
    for (uint32_t i = 0; isotherm_next_gyro_tick(&ticks, &tick); ++i) {
        if (i == 0) first = tick.readings;
        if (!isotherm_is_alike(&first, &tick.readings, tick.half_periods_count)) return false;
    }
    return true;
}

static inline bool isotherm_rule_alike_accelerometer_batch(const isotherm_accelerometer_batch *batch) {
    isotherm_list ticks = batch->ticks;
    isotherm_readings first = {ISOTHERM_READINGS_COUNTS, 0, {0}, 0, {0}};
    isotherm_accelerometer_tick tick;
    for (uint32_t i = 0; isotherm_next_accelerometer_tick(&ticks, &tick); ++i) {
        if (i == 0) first = tick.readings;
        if (!isotherm_is_alike(&first, &tick.readings, 0)) return false;
    }
    return true;
}

static inline bool isotherm_rule_per_channel_temperature_batch(const isotherm_temperature_batch *batch) {
    isotherm_list ticks = batch->ticks;
    isotherm_temperature_tick tick;
    while (isotherm_next_temperature_tick(&ticks, &tick)) {
        if (tick.raw_count != batch->channels_count) return false;
    }
    return true;
}

static inline bool isotherm_is_finite(isotherm_real value) { return value - value == 0; }

static inline bool isotherm_rule_span_rate_reference(const isotherm_rate_reference *reference) {
    const isotherm_real *rate = reference->angular_rate_rad_per_s;
    return reference->end_ns > reference->start_ns && isotherm_is_finite(rate[0]) && isotherm_is_finite(rate[1])
        && isotherm_is_finite(rate[2]) && isotherm_is_finite(reference->sigma_rad_per_s) && reference->sigma_rad_per_s >= 0;
}

static inline bool isotherm_rule_part_journal_part(const isotherm_journal_part *part) {
    return part->part < part->parts && part->parts <= ISOTHERM_MAX_PARTS;
}

/* Frames. */

/* The version that a frame says, 0 where it is too short to say one: which of several decoders to call. */
static inline unsigned isotherm_version(const uint8_t *frame, size_t length) { return length < 2 ? 0 : frame[1]; }

/* Checks a frame, and finds its body. */
static inline isotherm_result
isotherm_open(const uint8_t *frame, size_t length, unsigned kind, unsigned version, isotherm_cursor *body) {
    if (length < ISOTHERM_MIN_FRAME_BYTES || length > ISOTHERM_MAX_FRAME_BYTES) return ISOTHERM_LENGTH;
    if (frame[0] != kind) return ISOTHERM_KIND;
    if (frame[1] != version) return ISOTHERM_VERSION;
    const uint8_t *said = frame + length - 4;
    uint32_t checksum = 0;
    for (unsigned i = 0; i < 4; ++i) checksum |= (uint32_t)said[i] << (8 * i);
    if (checksum != isotherm_crc32(frame, length - 4)) return ISOTHERM_CHECKSUM;
    body->at = frame + 2;
    body->end = said;
    return ISOTHERM_OK;
}

/* generated: frames */
/* Version 1 of kind 1; what `o` holds after an error means nothing. */
static inline isotherm_result isotherm_decode_gyro_batch(const uint8_t *frame, size_t length, isotherm_gyro_batch *o) {
    isotherm_cursor c;
    const isotherm_result opened = isotherm_open(frame, length, ISOTHERM_KIND_RAW_GYRO, 1u, &c);
    if (opened != ISOTHERM_OK) return opened;
    if (!isotherm_read_gyro_batch(&c, o)) return ISOTHERM_BODY;
    if (c.at != c.end) return ISOTHERM_LEFT_OVER;
    if (!isotherm_rule_alike_gyro_batch(o)) return ISOTHERM_RULE;
    return ISOTHERM_OK;
}

/* Version 1 of kind 2; what `o` holds after an error means nothing. */
static inline isotherm_result isotherm_decode_accelerometer_batch(const uint8_t *frame, size_t length, isotherm_accelerometer_batch *o) {
    isotherm_cursor c;
    const isotherm_result opened = isotherm_open(frame, length, ISOTHERM_KIND_RAW_ACCEL, 1u, &c);
    if (opened != ISOTHERM_OK) return opened;
    if (!isotherm_read_accelerometer_batch(&c, o)) return ISOTHERM_BODY;
    if (c.at != c.end) return ISOTHERM_LEFT_OVER;
    if (!isotherm_rule_alike_accelerometer_batch(o)) return ISOTHERM_RULE;
    return ISOTHERM_OK;
}

/* Version 1 of kind 3; what `o` holds after an error means nothing. */
static inline isotherm_result isotherm_decode_temperature_batch(const uint8_t *frame, size_t length, isotherm_temperature_batch *o) {
    isotherm_cursor c;
    const isotherm_result opened = isotherm_open(frame, length, ISOTHERM_KIND_RAW_TEMPERATURE, 1u, &c);
    if (opened != ISOTHERM_OK) return opened;
    if (!isotherm_read_temperature_batch(&c, o)) return ISOTHERM_BODY;
    if (c.at != c.end) return ISOTHERM_LEFT_OVER;
    if (!isotherm_rule_per_channel_temperature_batch(o)) return ISOTHERM_RULE;
    return ISOTHERM_OK;
}

/* Version 1 of kind 4; what `o` holds after an error means nothing. */
static inline isotherm_result isotherm_decode_corrected_batch(const uint8_t *frame, size_t length, isotherm_corrected_batch *o) {
    isotherm_cursor c;
    const isotherm_result opened = isotherm_open(frame, length, ISOTHERM_KIND_CORRECTED, 1u, &c);
    if (opened != ISOTHERM_OK) return opened;
    if (!isotherm_read_corrected_batch(&c, o)) return ISOTHERM_BODY;
    if (c.at != c.end) return ISOTHERM_LEFT_OVER;
    return ISOTHERM_OK;
}

/* Version 2 of kind 4; what `o` holds after an error means nothing. */
static inline isotherm_result isotherm_decode_corrected_batch_2(const uint8_t *frame, size_t length, isotherm_corrected_batch_2 *o) {
    isotherm_cursor c;
    const isotherm_result opened = isotherm_open(frame, length, ISOTHERM_KIND_CORRECTED, 2u, &c);
    if (opened != ISOTHERM_OK) return opened;
    if (!isotherm_read_corrected_batch_2(&c, o)) return ISOTHERM_BODY;
    if (c.at != c.end) return ISOTHERM_LEFT_OVER;
    return ISOTHERM_OK;
}

/* Version 3 of kind 4; what `o` holds after an error means nothing. */
static inline isotherm_result isotherm_decode_corrected_batch_3(const uint8_t *frame, size_t length, isotherm_corrected_batch_3 *o) {
    isotherm_cursor c;
    const isotherm_result opened = isotherm_open(frame, length, ISOTHERM_KIND_CORRECTED, 3u, &c);
    if (opened != ISOTHERM_OK) return opened;
    if (!isotherm_read_corrected_batch_3(&c, o)) return ISOTHERM_BODY;
    if (c.at != c.end) return ISOTHERM_LEFT_OVER;
    return ISOTHERM_OK;
}

/* Version 1 of kind 5; what `o` holds after an error means nothing. */
static inline isotherm_result isotherm_decode_status_1(const uint8_t *frame, size_t length, isotherm_status_1 *o) {
    isotherm_cursor c;
    const isotherm_result opened = isotherm_open(frame, length, ISOTHERM_KIND_STATUS, 1u, &c);
    if (opened != ISOTHERM_OK) return opened;
    if (!isotherm_read_status_1(&c, o)) return ISOTHERM_BODY;
    if (c.at != c.end) return ISOTHERM_LEFT_OVER;
    return ISOTHERM_OK;
}

/* Version 2 of kind 5; what `o` holds after an error means nothing. */
static inline isotherm_result isotherm_decode_status(const uint8_t *frame, size_t length, isotherm_status *o) {
    isotherm_cursor c;
    const isotherm_result opened = isotherm_open(frame, length, ISOTHERM_KIND_STATUS, 2u, &c);
    if (opened != ISOTHERM_OK) return opened;
    if (!isotherm_read_status(&c, o)) return ISOTHERM_BODY;
    if (c.at != c.end) return ISOTHERM_LEFT_OVER;
    return ISOTHERM_OK;
}

/* Version 1 of kind 6; what `o` holds after an error means nothing. */
static inline isotherm_result isotherm_decode_health_batch(const uint8_t *frame, size_t length, isotherm_health_batch *o) {
    isotherm_cursor c;
    const isotherm_result opened = isotherm_open(frame, length, ISOTHERM_KIND_RAW_HEALTH, 1u, &c);
    if (opened != ISOTHERM_OK) return opened;
    if (!isotherm_read_health_batch(&c, o)) return ISOTHERM_BODY;
    if (c.at != c.end) return ISOTHERM_LEFT_OVER;
    return ISOTHERM_OK;
}

/* Version 1 of kind 7; what `o` holds after an error means nothing. */
static inline isotherm_result isotherm_decode_service_status(const uint8_t *frame, size_t length, isotherm_service_status *o) {
    isotherm_cursor c;
    const isotherm_result opened = isotherm_open(frame, length, ISOTHERM_KIND_SERVICE_STATUS, 1u, &c);
    if (opened != ISOTHERM_OK) return opened;
    if (!isotherm_read_service_status(&c, o)) return ISOTHERM_BODY;
    if (c.at != c.end) return ISOTHERM_LEFT_OVER;
    return ISOTHERM_OK;
}

/* Version 1 of kind 8; what `o` holds after an error means nothing. */
static inline isotherm_result isotherm_decode_rate_reference(const uint8_t *frame, size_t length, isotherm_rate_reference *o) {
    isotherm_cursor c;
    const isotherm_result opened = isotherm_open(frame, length, ISOTHERM_KIND_REFERENCE, 1u, &c);
    if (opened != ISOTHERM_OK) return opened;
    if (!isotherm_read_rate_reference(&c, o)) return ISOTHERM_BODY;
    if (c.at != c.end) return ISOTHERM_LEFT_OVER;
    if (!isotherm_rule_span_rate_reference(o)) return ISOTHERM_RULE;
    return ISOTHERM_OK;
}

/* Version 1 of kind 9; what `o` holds after an error means nothing. */
static inline isotherm_result isotherm_decode_journal_part(const uint8_t *frame, size_t length, isotherm_journal_part *o) {
    isotherm_cursor c;
    const isotherm_result opened = isotherm_open(frame, length, ISOTHERM_KIND_JOURNAL, 1u, &c);
    if (opened != ISOTHERM_OK) return opened;
    if (!isotherm_read_journal_part(&c, o)) return ISOTHERM_BODY;
    if (c.at != c.end) return ISOTHERM_LEFT_OVER;
    if (!isotherm_rule_part_journal_part(o)) return ISOTHERM_RULE;
    return ISOTHERM_OK;
}
/* generated: end of frames */

/* A corrected batch of any version; an older one has series 0, and one without standard errors no `sigmas`. */
static inline isotherm_result isotherm_decode_corrected(const uint8_t *frame, size_t length, isotherm_corrected_batch_3 *o) {
    const unsigned version = isotherm_version(frame, length);
    if (version != 1 && version != 2) return isotherm_decode_corrected_batch_3(frame, length, o);
    isotherm_corrected_batch plain;
    isotherm_corrected_batch_2 old;
    const isotherm_result result = version == 2 ? isotherm_decode_corrected_batch_2(frame, length, &old)
                                                : isotherm_decode_corrected_batch(frame, length, &plain);
    if (result != ISOTHERM_OK) return result;
    memset(o, 0, sizeof *o);
    o->unit = version == 2 ? old.unit : plain.unit;
    o->revision = version == 2 ? old.revision : plain.revision;
    o->temperatures_count = version == 2 ? old.temperatures_count : plain.temperatures_count;
    memcpy(o->temperatures, version == 2 ? old.temperatures : plain.temperatures, sizeof o->temperatures);
    o->ticks = version == 2 ? old.ticks : plain.ticks;
    if (version == 2) o->sigmas = old.sigmas;
    return ISOTHERM_OK;
}

/*
 * Writing a raw batch: begin with the number of ticks, add each, end. A producer has an isotherm_writer and a buffer; a gyro tick
 * takes at most 172 bytes, the rest of its frame 28. The end gives the frame's length, or 0 where something did not fit or ticks are
 * not alike.
 */
static inline isotherm_writer isotherm_begin(uint8_t *buffer, size_t size, unsigned kind, unsigned version, uint32_t ticks) {
    isotherm_writer w = {buffer, buffer, buffer, false, ticks, 0, false, false};
    if (size < ISOTHERM_MIN_FRAME_BYTES || ticks == 0 || ticks > ISOTHERM_MAX_TICKS) return w;
    w.end += (size < ISOTHERM_MAX_FRAME_BYTES ? size : ISOTHERM_MAX_FRAME_BYTES) - 4;
    w.ok = true;
    isotherm_put_u8(&w, (uint8_t)kind);
    isotherm_put_u8(&w, (uint8_t)version);
    return w;
}

static inline size_t isotherm_end(isotherm_writer *w) {
    if (!w->ok || w->left != 0) return 0;
    const uint32_t crc = isotherm_crc32(w->start, (size_t)(w->at - w->start));
    /* Room for it was kept. */
    for (unsigned i = 0; i < 4; ++i) *w->at++ = (uint8_t)(crc >> (8 * i));
    w->ok = false;
    return (size_t)(w->at - w->start);
}

/* Counts a tick, and compares its shape with the first's. */
static inline void isotherm_count_tick(isotherm_writer *w, uint32_t readings, bool means, uint32_t halves) {
    if (w->left == 0 || (w->begun && (readings != w->readings || means != w->means)) || (halves != 0 && halves != readings)) {
        w->ok = false;
        return;
    }
    w->readings = readings;
    w->means = means;
    w->begun = true;
    --w->left;
}

static inline void isotherm_count_readings(isotherm_writer *w, const isotherm_readings *readings, uint32_t halves) {
    const bool means = readings->variant == ISOTHERM_READINGS_MEANS;
    isotherm_count_tick(w, means ? readings->means_count : readings->counts_count, means, halves);
}

static inline isotherm_writer
isotherm_begin_gyro(uint8_t *buffer, size_t size, uint64_t first_sequence, uint64_t series, uint32_t ticks) {
    isotherm_writer w = isotherm_begin(buffer, size, ISOTHERM_KIND_RAW_GYRO, 1, ticks);
    isotherm_put_u64(&w, first_sequence);
    isotherm_put_u64(&w, series);
    isotherm_put_u64(&w, ticks);
    return w;
}

static inline void isotherm_add_gyro(isotherm_writer *w, const isotherm_gyro_tick *tick) {
    isotherm_count_readings(w, &tick->readings, tick->half_periods_count);
    isotherm_write_gyro_tick(w, tick);
}

static inline isotherm_writer isotherm_begin_accel(uint8_t *buffer, size_t size, uint64_t first_sequence, uint32_t ticks) {
    isotherm_writer w = isotherm_begin(buffer, size, ISOTHERM_KIND_RAW_ACCEL, 1, ticks);
    isotherm_put_u64(&w, first_sequence);
    isotherm_put_u64(&w, ticks);
    return w;
}

static inline void isotherm_add_accel(isotherm_writer *w, const isotherm_accelerometer_tick *tick) {
    isotherm_count_readings(w, &tick->readings, 0);
    isotherm_write_accelerometer_tick(w, tick);
}

static inline isotherm_writer
isotherm_begin_temperature(uint8_t *buffer, size_t size, const isotherm_view *channels, uint32_t count, uint32_t ticks) {
    isotherm_writer w = isotherm_begin(buffer, size, ISOTHERM_KIND_RAW_TEMPERATURE, 1, ticks);
    isotherm_put_count(&w, ISOTHERM_MAX_CHANNELS, count);
    for (uint32_t i = 0; i < count && w.ok; ++i) isotherm_put_text(&w, ISOTHERM_MAX_CHANNEL_NAME_BYTES, channels[i]);
    isotherm_put_u64(&w, ticks);
    w.readings = count;
    w.begun = true;
    return w;
}

static inline void isotherm_add_temperature(isotherm_writer *w, const isotherm_temperature_tick *tick) {
    isotherm_count_tick(w, tick->raw_count, false, 0);
    isotherm_write_temperature_tick(w, tick);
}

static inline isotherm_writer isotherm_begin_health(uint8_t *buffer, size_t size, uint32_t ticks) {
    isotherm_writer w = isotherm_begin(buffer, size, ISOTHERM_KIND_RAW_HEALTH, 1, ticks);
    isotherm_put_u64(&w, ticks);
    return w;
}

static inline void
isotherm_add_health(isotherm_writer *w, int64_t time_ns, const isotherm_health_reading *readings, uint32_t count) {
    isotherm_count_tick(w, 0, false, 0);
    isotherm_put_i64(w, time_ns);
    isotherm_put_count(w, ISOTHERM_MAX_HEALTH_READINGS, count);
    for (uint32_t i = 0; i < count && w->ok; ++i) isotherm_write_health_reading(w, &readings[i]);
}

/* The length of the frame, or 0. */
static inline size_t isotherm_encode_reference(uint8_t *buffer, size_t size, const isotherm_rate_reference *reference) {
    isotherm_writer w = isotherm_begin(buffer, size, ISOTHERM_KIND_REFERENCE, 1, 1);
    if (!isotherm_rule_span_rate_reference(reference)) return 0;
    isotherm_write_rate_reference(&w, reference);
    w.left = 0;
    return isotherm_end(&w);
}

/* Continuity: what of a unit's raw gyro ticks arrived, was announced as missing, or was lost on the way. Begin with all zero. */
typedef struct {
    uint64_t ticks, announced_missing, lost, duplicated, restarts;
    uint64_t series, last;
    bool begun;
} isotherm_account;

static inline uint64_t isotherm_add_saturating(uint64_t a, uint64_t b) { return a > UINT64_MAX - b ? UINT64_MAX : a + b; }

static inline uint64_t isotherm_first(const isotherm_corrected_tick *tick) {
    const uint64_t before = tick->ticks > 1 ? tick->ticks - 1u : 0;
    return tick->sequence > before ? tick->sequence - before : 0;
}

/* Enters a tick of a batch of this series. */
static inline void isotherm_enter(isotherm_account *account, uint64_t series, const isotherm_corrected_tick *tick) {
    const uint64_t first = isotherm_first(tick);
    if (account->begun && (tick->flags & ISOTHERM_TICK_RESTART) != 0) {
        ++account->restarts;
    } else if (account->begun && series == account->series) {
        const uint64_t expected = isotherm_add_saturating(isotherm_add_saturating(account->last, 1), tick->missed);
        if (first > expected) account->lost = isotherm_add_saturating(account->lost, first - expected);
        if (first < expected) account->duplicated = isotherm_add_saturating(account->duplicated, expected - first);
    }
    account->ticks = isotherm_add_saturating(account->ticks, tick->ticks > 1 ? tick->ticks : 1u);
    account->announced_missing = isotherm_add_saturating(account->announced_missing, tick->missed);
    account->series = series;
    account->last = tick->sequence;
    account->begun = true;
}

/*
 * First wins: of two services that correct one unit, the tick that comes first is used (docs/wire.md). Begin with all zero.
 * Enter into the account what isotherm_wins lets through.
 */
typedef struct {
    uint64_t series;
    uint64_t sequence;   /* the highest used */
    int64_t end_time_ns; /* the latest used: the clock may have stepped back since */
    bool known;
} isotherm_run;

/* The runs before the present one that are remembered: a service may lag behind as many restarts of the producer. */
#define ISOTHERM_RUNS_BEFORE 3
/* Outputs that a service may lag behind; with RESTART, beyond fewer a producer counts from the beginning again. */
#define ISOTHERM_MOST_BEHIND 8192u
#define ISOTHERM_MOST_BEHIND_RESTART 512u

typedef struct {
    isotherm_run current, before[ISOTHERM_RUNS_BEFORE];
    uint64_t dropped;
} isotherm_arbiter;

/* Whether a distance of numbers is so short that a lag of the other service may be the cause. */
static inline bool isotherm_is_near(uint64_t distance, const isotherm_corrected_tick *tick) {
    const bool restarts = (tick->flags & ISOTHERM_TICK_RESTART) != 0;
    return distance / (tick->ticks > 1 ? tick->ticks : 1u) < (restarts ? ISOTHERM_MOST_BEHIND_RESTART : ISOTHERM_MOST_BEHIND);
}

/* Whether to use a tick of a batch of this series. */
static inline bool isotherm_wins(isotherm_arbiter *arbiter, uint64_t series, const isotherm_corrected_tick *tick) {
    isotherm_run *current = &arbiter->current;
    const uint64_t first = isotherm_first(tick), last = tick->sequence;
    const int64_t end = tick->end_time_ns;
    const bool is_same = current->known && series == current->series;
    const bool goes_on = is_same && first > current->sequence && isotherm_is_near(first - current->sequence, tick);
    bool wins = true;
    if (is_same && first <= current->sequence) {
        const bool overlaps = last > current->sequence;
        wins = !((overlaps || end <= current->end_time_ns) && isotherm_is_near(overlaps ? 0 : current->sequence - last, tick));
    }
    for (size_t i = 0; i < ISOTHERM_RUNS_BEFORE && wins; ++i) {
        const isotherm_run *run = &arbiter->before[i];
        if (!run->known || series != run->series) continue;
        if (first > run->sequence) {
            /* The end of a run, which the other service's message lost. */
            wins = is_same || (tick->flags & ISOTHERM_TICK_RESTART) != 0 || !isotherm_is_near(first - run->sequence, tick);
            continue;
        }
        const uint64_t back = run->sequence > last ? run->sequence - last : 0;
        /* Numbers and time began again: the present run comes past this one's. */
        const bool passes = goes_on && end > current->end_time_ns && first - current->sequence - 1 <= back;
        wins = end > run->end_time_ns || passes || !isotherm_is_near(back, tick);
    }
    if (!wins) {
        ++arbiter->dropped;
        return false;
    }
    if (!goes_on) {
        for (size_t i = ISOTHERM_RUNS_BEFORE - 1; i > 0; --i) arbiter->before[i] = arbiter->before[i - 1];
        arbiter->before[0] = *current;
    }
    current->end_time_ns = goes_on && current->end_time_ns > end ? current->end_time_ns : end;
    current->series = series;
    current->sequence = last;
    current->known = true;
    return true;
}

#endif
