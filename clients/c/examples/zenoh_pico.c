/*
 * The same with zenoh-pico 1.x, for small computers: no heap of ours, frames up to the size of zenoh-pico's buffer.
 *
 *     cc -std=c11 -DISOTHERM_ZENOH zenoh_pico.c -lzenohpico -o zenoh_pico
 *     ./zenoh_pico ZLG-0001 tcp/127.0.0.1:7447
 *
 * It connects once, and again by itself where the connection is lost: start it anew until a service is there.
 * zenoh-pico fragments and joins: set Z_FRAG_MAX_SIZE above the longest batch (some 110 bytes per tick). Without ISOTHERM_ZENOH it
 * reads a file of `isotherm-replay correct --format wire` from stdin instead.
 */
#include "receive.h"

#ifdef ISOTHERM_ZENOH
#include <zenoh-pico.h>

/* On the read task's thread: decoding takes less than a microsecond per tick. */
static void on_sample(z_loaned_sample_t *sample, void *context) {
    z_owned_slice_t frame;
    if (z_bytes_to_slice(z_sample_payload(sample), &frame) < 0) return;
    receive(context, z_slice_data(z_loan(frame)), z_slice_len(z_loan(frame)));
    z_drop(z_move(frame));
}

int main(int argc, char **argv) {
    if (argc != 3) {
        fprintf(stderr, "usage: zenoh_pico UNIT ENDPOINT\n");
        return 2;
    }
    char key[96];
    snprintf(key, sizeof key, "imu/%s/corrected", argv[1]);
    z_owned_config_t config;
    z_config_default(&config);
    zp_config_insert(z_loan_mut(config), Z_CONFIG_MODE_KEY, "client");
    zp_config_insert(z_loan_mut(config), Z_CONFIG_CONNECT_KEY, argv[2]);
    z_owned_session_t session;
    if (z_open(&session, z_move(config), NULL) < 0) {
        fprintf(stderr, "%s: no router or service there\n", argv[2]);
        return 1;
    }
    static receiver r;
    z_owned_closure_sample_t closure;
    z_closure(&closure, on_sample, NULL, &r);
    z_view_keyexpr_t expression;
    z_owned_subscriber_t subscriber;
    if (zp_start_read_task(z_loan_mut(session), NULL) < 0 || zp_start_lease_task(z_loan_mut(session), NULL) < 0
        || z_view_keyexpr_from_str(&expression, key) < 0
        || z_declare_subscriber(z_loan(session), &subscriber, z_loan(expression), z_move(closure), NULL) < 0) {
        fprintf(stderr, "%s: cannot subscribe\n", key);
        return 1;
    }
    while (getchar() != EOF) {
    }
    z_drop(z_move(subscriber));
    z_drop(z_move(session));
    return finish(&r);
}
#else
int main(void) {
    static receiver r;
    return receive_stdin(&r);
}
#endif
