/*
 * Reads the cases of clients/cases.txt, and says of each what the account and the arbiter made of it:
 * "NAME verdicts ticks announced_missing lost duplicated restarts", with a letter per tick: u used, d dropped.
 */
#include "../isotherm.h"

#include <inttypes.h>
#include <stdio.h>

static isotherm_account account;
static isotherm_arbiter arbiter;
static char name[64] = "", verdicts[256];
static size_t count = 0;

static void show(void) {
    if (name[0] == 0) return;
    verdicts[count] = 0;
    printf("%s %s %" PRIu64 " %" PRIu64 " %" PRIu64 " %" PRIu64 " %" PRIu64 "\n", name, verdicts, account.ticks,
        account.announced_missing, account.lost, account.duplicated, account.restarts);
}

int main(void) {
    char line[256];
    bool first_wins = false;
    while (fgets(line, sizeof line, stdin) != NULL) {
        isotherm_corrected_tick tick;
        char what[16];
        unsigned restart = 0;
        uint64_t series = 0;
        memset(&tick, 0, sizeof tick);
        if (line[0] == '=') {
            char next[64] = "";
            if (sscanf(line, "= %63s %15s", next, what) != 2) return 2;
            show();
            memcpy(name, next, sizeof name);
            first_wins = strcmp(what, "first-wins") == 0;
            memset(&account, 0, sizeof account);
            memset(&arbiter, 0, sizeof arbiter);
            count = 0;
        } else if (sscanf(line, "%" SCNu64 " %" SCNu64 " %" SCNd64 " %" SCNu64 " %" SCNu16 " %" SCNu64 " %u", &series,
                       &tick.sequence, &tick.end_time_ns, &tick.duration_ns, &tick.ticks, &tick.missed, &restart)
            == 7) {
            tick.flags = restart != 0 ? (uint16_t)ISOTHERM_TICK_RESTART : 0;
            const bool used = !first_wins || isotherm_wins(&arbiter, series, &tick);
            if (used) isotherm_enter(&account, series, &tick);
            if (count + 1 < sizeof verdicts) verdicts[count++] = used ? 'u' : 'd';
        }
    }
    show();
    return 0;
}
