/*
 * Decodes a batch of 32 corrected ticks over and over and prints the time per tick; checks the result first. The frame is that of the
 * service, with three gyros and three accelerometers: bench < FRAME
 */
#include "isotherm.h"

#include <stdio.h>
#include <time.h>

#define TICKS 32u
#define ROUNDS 200000u

int main(void) {
    static uint8_t frame[ISOTHERM_MAX_FRAME_BYTES];
    const size_t length = fread(frame, 1, sizeof frame, stdin);
    isotherm_corrected_batch_3 batch;
    isotherm_corrected_tick tick;
    const isotherm_result result = isotherm_decode_corrected(frame, length, &batch);
    if (result != ISOTHERM_OK || batch.ticks.count != TICKS) {
        fprintf(stderr, "stdin: no frame of %u ticks: %s\n", TICKS, isotherm_words(result));
        return 1;
    }
    double sum = 0;
    const clock_t start = clock();
    for (uint32_t round = 0; round < ROUNDS; ++round) {
        if (isotherm_decode_corrected(frame, length, &batch) != ISOTHERM_OK) return 1;
        while (isotherm_next_corrected_tick(&batch.ticks, &tick)) sum += (double)tick.delta_angle_rad[2];
    }
    const double seconds = (double)(clock() - start) / CLOCKS_PER_SEC;
    printf("{\"ns_per_tick\":%.1f,\"ticks\":%u,\"bytes\":%zu,\"sum\":%g}\n", 1e9 * seconds / ROUNDS / TICKS, ROUNDS * TICKS, length, sum);
    return 0;
}
