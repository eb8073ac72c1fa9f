/*
 * fuzz COUNT SEED < lines "KIND HEX": frames made of these by a few changes, with a checksum that mostly fits, decoded as every
 * kind and walked to the end; what decodes as a raw batch is written again. Built with sanitizers, each frame ends where its memory
 * ends. Prints how many were read and refused, and how many sets of standard errors were walked.
 */
#include "../isotherm.h"

#include <ctype.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

#define SEEDS 256
#define LONGEST 4096

static uint64_t state;

static uint32_t random_below(uint32_t limit) {
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    return (uint32_t)(state >> 32) % limit;
}

static uint8_t seeds[SEEDS][LONGEST];
static size_t lengths[SEEDS], seed_count = 0;
static isotherm_account account;
static isotherm_arbiter arbiter;
static volatile uint64_t sink = 0;
static uint64_t sigmas = 0;
static uint8_t *space, out[2 * LONGEST];

/* Takes every byte of a view. */
static void take(isotherm_view view) {
    for (size_t i = 0; i < view.length; ++i) sink += view.at[i];
}

static void walk_status(const isotherm_status *status) {
    isotherm_list list = status->channels;
    isotherm_channel_status channel;
    while (isotherm_next_channel_status(&list, &channel)) take(channel.name);
    list = status->sensors;
    isotherm_sensor_status sensor;
    while (isotherm_next_sensor_status(&list, &sensor)) take(sensor.name);
    list = status->counters;
    isotherm_counter counter;
    while (isotherm_next_counter(&list, &counter)) take(counter.name);
    list = status->faults;
    isotherm_fault fault;
    while (isotherm_next_fault(&list, &fault)) take(fault.first);
    if (status->has_pre_launch_outcome) {
        list = status->pre_launch_outcome.verdict.refused;
        isotherm_view reason;
        if (status->pre_launch_outcome.verdict.variant == ISOTHERM_VERDICT_REFUSED) {
            while (isotherm_next_text(&list, &reason)) take(reason);
        }
    }
}

/* Decodes a frame as a kind; whether it was read. */
static bool decode(unsigned kind, const uint8_t *frame, size_t length) {
    switch (kind) {
    case ISOTHERM_KIND_RAW_GYRO: {
        isotherm_gyro_batch batch;
        isotherm_gyro_tick tick;
        if (isotherm_decode_gyro_batch(frame, length, &batch) != ISOTHERM_OK) return false;
        isotherm_writer w = isotherm_begin_gyro(out, random_below(sizeof out), batch.first_sequence, batch.series, batch.ticks.count);
        while (isotherm_next_gyro_tick(&batch.ticks, &tick)) isotherm_add_gyro(&w, &tick);
        const size_t written = isotherm_end(&w);
        if (written != 0 && isotherm_decode_gyro_batch(out, written, &batch) != ISOTHERM_OK) abort();
        return true;
    }
    case ISOTHERM_KIND_RAW_ACCEL: {
        isotherm_accelerometer_batch batch;
        isotherm_accelerometer_tick tick;
        if (isotherm_decode_accelerometer_batch(frame, length, &batch) != ISOTHERM_OK) return false;
        isotherm_writer w = isotherm_begin_accel(out, sizeof out, batch.first_sequence, batch.ticks.count);
        while (isotherm_next_accelerometer_tick(&batch.ticks, &tick)) isotherm_add_accel(&w, &tick);
        if (isotherm_end(&w) == 0) abort();
        return true;
    }
    case ISOTHERM_KIND_RAW_TEMPERATURE: {
        isotherm_temperature_batch batch;
        isotherm_temperature_tick tick;
        if (isotherm_decode_temperature_batch(frame, length, &batch) != ISOTHERM_OK) return false;
        for (uint32_t i = 0; i < batch.channels_count; ++i) take(batch.channels[i]);
        while (isotherm_next_temperature_tick(&batch.ticks, &tick)) sink += tick.raw_count;
        return true;
    }
    case ISOTHERM_KIND_CORRECTED: {
        isotherm_corrected_batch_3 batch;
        isotherm_corrected_tick tick;
        if (isotherm_decode_corrected(frame, length, &batch) != ISOTHERM_OK) return false;
        take(batch.unit);
        while (isotherm_next_corrected_tick(&batch.ticks, &tick)) {
            if (isotherm_wins(&arbiter, batch.series, &tick)) isotherm_enter(&account, batch.series, &tick);
        }
        isotherm_sigma sigma;
        while (isotherm_next_sigma(&batch.sigmas, &sigma)) {
            sink += sigma.from_tick;
            ++sigmas;
        }
        return true;
    }
    case ISOTHERM_KIND_STATUS: {
        isotherm_status status;
        isotherm_status_1 old;
        if (isotherm_version(frame, length) == 1) return isotherm_decode_status_1(frame, length, &old) == ISOTHERM_OK;
        if (isotherm_decode_status(frame, length, &status) != ISOTHERM_OK) return false;
        walk_status(&status);
        return true;
    }
    case ISOTHERM_KIND_RAW_HEALTH: {
        isotherm_health_batch batch;
        return isotherm_decode_health_batch(frame, length, &batch) == ISOTHERM_OK;
    }
    case ISOTHERM_KIND_SERVICE_STATUS: {
        isotherm_service_status status;
        return isotherm_decode_service_status(frame, length, &status) == ISOTHERM_OK;
    }
    case ISOTHERM_KIND_REFERENCE: {
        isotherm_rate_reference reference;
        return isotherm_decode_rate_reference(frame, length, &reference) == ISOTHERM_OK;
    }
    default: {
        isotherm_journal_part part;
        if (isotherm_decode_journal_part(frame, length, &part) != ISOTHERM_OK) return false;
        take(part.bytes);
        return true;
    }
    }
}

static size_t change(uint8_t *frame, size_t length) {
    static const uint8_t telling[] = {0x00, 0x01, 0x02, 0x7f, 0x80, 0x81, 0xfe, 0xff};
    for (uint32_t changes = random_below(4); changes > 0; --changes) {
        const size_t at = length > 0 ? random_below((uint32_t)length) : 0;
        switch (random_below(6)) {
        case 0: frame[at] ^= (uint8_t)(1u << random_below(8)); break;
        case 1: frame[at] = telling[random_below(sizeof telling)]; break;
        case 2: frame[at] = (uint8_t)random_below(256); break;
        case 3: length = at; break;
        case 4: /* A piece of another frame. */
        {
            const uint32_t other = random_below((uint32_t)seed_count);
            const size_t from = random_below((uint32_t)lengths[other] + 1);
            size_t count = random_below(32);
            if (count > lengths[other] - from) count = lengths[other] - from;
            if (count > length - at) count = length - at;
            memcpy(frame + at, seeds[other] + from, count);
            break;
        }
        default: /* Bytes that were not there. */
        {
            const size_t count = random_below(16);
            if (length + count > LONGEST) break;
            memmove(frame + at + count, frame + at, length - at);
            length += count;
            for (size_t i = 0; i < count; ++i) frame[at + i] = telling[random_below(sizeof telling)];
        }
        }
    }
    return length;
}

int main(int argc, char **argv) {
    if (argc != 3) {
        fprintf(stderr, "usage: fuzz COUNT SEED < frames\n");
        return 2;
    }
    const uint64_t count = strtoull(argv[1], NULL, 10);
    state = strtoull(argv[2], NULL, 10) * UINT64_C(0x9e3779b97f4a7c15) + 1;
    static char line[2 * LONGEST + 64];
    while (fgets(line, sizeof line, stdin) != NULL && seed_count < SEEDS) {
        char *at = line;
        (void)strtoul(line, &at, 10);
        unsigned byte = 0;
        int used = 0;
        while (lengths[seed_count] < LONGEST && sscanf(at, " %2x%n", &byte, &used) == 1) {
            seeds[seed_count][lengths[seed_count]++] = (uint8_t)byte;
            at += used;
        }
        if (lengths[seed_count] >= 6) ++seed_count;
        else lengths[seed_count] = 0;
    }
    space = malloc(LONGEST);
    if (space == NULL || seed_count == 0) return 1;
    uint64_t read = 0, refused = 0;
    static uint8_t frame[LONGEST];
    for (uint64_t i = 0; i < count; ++i) {
        const uint32_t seed = random_below((uint32_t)seed_count);
        memcpy(frame, seeds[seed], lengths[seed]);
        size_t length = change(frame, lengths[seed]);
        if (length >= 6 && random_below(16) != 0) {
            const uint32_t crc = isotherm_crc32(frame, length - 4);
            for (unsigned k = 0; k < 4; ++k) frame[length - 4 + k] = (uint8_t)(crc >> (8 * k));
        }
        uint8_t *last = space + LONGEST - length;
        memcpy(last, frame, length);
        const unsigned kind = length > 0 && random_below(16) != 0 ? last[0] : 1 + random_below(9);
        if (decode(kind, last, length)) ++read;
        else ++refused;
    }
    printf("%" PRIu64 " read, %" PRIu64 " refused, %" PRIu64 " standard errors walked\n", read, refused, sigmas);
    free(space);
    return 0;
}
