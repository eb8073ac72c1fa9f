/*
 * Subscribes to a unit's corrected ticks with zenoh-c 1.x:
 *
 *     cc -std=c11 -DISOTHERM_ZENOH zenoh_c.c -lzenohc -o zenoh_c
 *     ./zenoh_c ZLG-0001 tcp/127.0.0.1:7447
 *
 * Without ISOTHERM_ZENOH it reads a file of `isotherm-replay correct --format wire` from stdin instead.
 */
#include "receive.h"

#ifdef ISOTHERM_ZENOH
#include <stdlib.h>
#include <zenoh.h>

int main(int argc, char **argv) {
    if (argc != 3) {
        fprintf(stderr, "usage: zenoh_c UNIT ENDPOINT\n");
        return 2;
    }
    char key[96], endpoints[256];
    snprintf(key, sizeof key, "imu/%s/corrected", argv[1]);
    snprintf(endpoints, sizeof endpoints, "[\"%s\"]", argv[2]);
    z_owned_config_t config;
    z_config_default(&config);
    zc_config_insert_json5(z_loan_mut(config), "mode", "\"client\"");
    zc_config_insert_json5(z_loan_mut(config), "connect/endpoints", endpoints);
    /* Waits for a service that is not there yet, and soon finds one that was restarted. */
    zc_config_insert_json5(z_loan_mut(config), "connect/timeout_ms", "-1");
    zc_config_insert_json5(z_loan_mut(config), "connect/retry", "{period_init_ms: 100, period_max_ms: 500}");
    z_owned_session_t session;
    if (z_open(&session, z_move(config), NULL) < 0) {
        fprintf(stderr, "%s: no router or service there\n", argv[2]);
        return 1;
    }
    /* An unbounded queue would be better still; this one drops its oldest entry, and the account shows it. */
    z_owned_closure_sample_t closure;
    z_owned_ring_handler_sample_t handler;
    z_ring_channel_sample_new(&closure, &handler, 1024);
    z_view_keyexpr_t expression;
    z_owned_subscriber_t subscriber;
    if (z_view_keyexpr_from_str(&expression, key) < 0
        || z_declare_subscriber(z_loan(session), &subscriber, z_loan(expression), z_move(closure), NULL) < 0) {
        fprintf(stderr, "%s: cannot subscribe\n", key);
        return 1;
    }
    static receiver r;
    z_owned_sample_t sample;
    while (z_recv(z_loan(handler), &sample) == Z_OK) {
        z_owned_slice_t frame;
        if (z_bytes_to_slice(z_sample_payload(z_loan(sample)), &frame) == Z_OK) {
            receive(&r, z_slice_data(z_loan(frame)), z_slice_len(z_loan(frame)));
            z_drop(z_move(frame));
        }
        z_drop(z_move(sample));
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
