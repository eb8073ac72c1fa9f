/* What both examples do with what they receive; no Zenoh in it. */
#include "../isotherm.h"

#include <inttypes.h>
#include <stdio.h>

typedef struct {
    isotherm_arbiter arbiter;
    isotherm_account account;
    uint64_t refused;
} receiver;

/* Takes one frame: says what it holds, or why it is refused; the stream goes on. */
static void receive(receiver *r, const uint8_t *frame, size_t length) {
    isotherm_corrected_batch_3 batch;
    const isotherm_result result = isotherm_decode_corrected(frame, length, &batch);
    if (result != ISOTHERM_OK) {
        ++r->refused;
        fprintf(stderr, "a frame of %zu bytes is refused: %s\n", length, isotherm_words(result));
        return;
    }
    isotherm_corrected_tick tick;
    while (isotherm_next_corrected_tick(&batch.ticks, &tick)) {
        if (!isotherm_wins(&r->arbiter, batch.series, &tick)) continue;
        isotherm_enter(&r->account, batch.series, &tick);
        if ((tick.flags & ISOTHERM_TICK_ANGLE_INVALID) != 0) continue;
        printf("%" PRIu64 " %g %g %g rad\n", tick.sequence, (double)tick.delta_angle_rad[0], (double)tick.delta_angle_rad[1],
            (double)tick.delta_angle_rad[2]);
    }
}

static int finish(const receiver *r) {
    fprintf(stderr, "%" PRIu64 " ticks, %" PRIu64 " announced missing, %" PRIu64 " lost, %" PRIu64 " frames refused\n",
        r->account.ticks, r->account.announced_missing, r->account.lost, r->refused);
    return r->account.lost != 0 ? 3 : 0;
}

/* Without Zenoh: frames from stdin, each after its length (u32, little-endian), as isotherm-replay correct --format wire writes them. */
static inline int receive_stdin(receiver *r) {
    static uint8_t frame[ISOTHERM_MAX_FRAME_BYTES];
    uint8_t head[4];
    while (fread(head, 1, sizeof head, stdin) == sizeof head) {
        const uint32_t length = head[0] | (uint32_t)head[1] << 8 | (uint32_t)head[2] << 16 | (uint32_t)head[3] << 24;
        if (length > sizeof frame || fread(frame, 1, length, stdin) != length) {
            fprintf(stderr, "stdin: a frame of %" PRIu32 " bytes is cut short or longer than %zu\n", length, sizeof frame);
            return 1;
        }
        receive(r, frame, length);
    }
    return finish(r);
}
