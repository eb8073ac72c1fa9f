"""Continuity and first wins: the cases of clients/cases.txt, and two services with lags of every kind."""

from __future__ import annotations

import random
import unittest
from typing import Any

import isotherm
import numpy as np
from common import ROOT


def tick(sequence: int, end: int, duration: int, number: int = 1, missed: int = 0, restart: int = 0) -> Any:
    row = np.zeros(1, isotherm.TICK)
    row["sequence"], row["end_time_ns"], row["duration_ns"] = sequence, end, duration
    row["ticks"], row["missed"], row["flags"] = number, missed, restart * isotherm.TickFlag.RESTART
    return row


def figures(account: isotherm.Account) -> list[int]:
    return [account.ticks, account.announced_missing, account.lost, account.duplicated, account.restarts]


class Cases(unittest.TestCase):
    def test_the_cases(self) -> None:
        rows: list[Any] = []
        first_wins, name, judged = False, "", 0
        for line in (ROOT / "clients/cases.txt").read_text(encoding="utf-8").splitlines():
            if line.startswith("= "):
                _, name, what = line.split()
                rows, first_wins = [], what == "first-wins"
            elif line.startswith("> "):
                _, verdicts, *expected = line.split()
                with self.subTest(name):
                    account, arbiter, got = isotherm.Account(), isotherm.FirstWins(), ""
                    for series, row in rows:
                        used = arbiter.choose(row, series) if first_wins else row
                        account.enter(used, series)
                        got += "u" if len(used) else "d"
                    self.assertEqual(got, verdicts)
                    self.assertEqual(figures(account), [int(figure) for figure in expected])
                judged += 1
            elif line and not line.startswith("#"):
                series, *figures_of_tick = map(int, line.split())
                rows.append((series, tick(*figures_of_tick)))
        self.assertGreater(judged, 10)


class TwoServices(unittest.TestCase):
    def test_every_tick_is_used_once_whatever_the_lags_and_batches(self) -> None:
        for seed in range(30):
            draw = random.Random(seed)
            stream = []
            sequence, time, restart, since, duration = draw.randint(0, 10**6), draw.randint(0, 10**12), 0, 0, 5_000_000
            begun_again = False
            # Durations that fill the period, and such that do not.
            share = draw.choice([1, 1, 0.8, 0.1])
            for _ in range(1000):
                jitter = draw.randint(-20_000, 20_000)
                stream.append(tick(sequence, time, int((duration + jitter) * share), restart=restart))
                sequence, time, restart, since = sequence + 1, time + duration + jitter, 0, since + 1
                if draw.random() < 0.01:
                    duration = draw.choice([1_000_000, 5_000_000, 20_000_000])
                # Further apart than a service may be behind.
                if since > 80 and draw.random() < 0.02:
                    kind, restart, since = draw.choice(["restarts", "forward", "back"]), 1, 0
                    if kind == "restarts" and not begun_again:
                        # Number and time may begin again once, where the numbers are far enough.
                        begun_again = sequence > 10_000
                        sequence, time = draw.randint(0, 1000), 0 if begun_again else time + draw.randint(10**9, 10**10)
                    else:
                        # The clock steps, the numbers go on.
                        time += draw.randint(10**7, 10**9) * (-1 if kind == "back" else 1)
            ticks = np.concatenate(stream)
            arbiter, account, used = isotherm.FirstWins(), isotherm.Account(), []
            places = [0, 0]
            while min(places) < len(ticks):
                # Each service goes on by a batch of its own length; neither is more than 40 ticks behind.
                service = draw.randint(0, 1)
                if places[service] >= len(ticks) or places[service] - places[1 - service] > 40:
                    service = 1 - service
                end = min(len(ticks), places[service] + draw.randint(1, 32))
                chosen = arbiter.choose(ticks[places[service] : end])
                account.enter(chosen)
                used.append(chosen)
                places[service] = end
            restarts = int(np.count_nonzero(ticks["flags"]))
            np.testing.assert_array_equal(np.concatenate(used)["end_time_ns"], ticks["end_time_ns"], f"seed {seed}")
            self.assertEqual(figures(account), [len(ticks), 0, 0, 0, restarts], f"seed {seed}")
            self.assertEqual(arbiter.dropped, len(ticks))

    def test_all_at_once_is_as_one_by_one(self) -> None:
        for seed in range(200):
            draw = random.Random(seed)
            rows, sequence, time = [], 1000, 10**9
            for _ in range(60):
                number = draw.choice([1, 1, 1, 4])
                skipped = draw.choice([0, 0, 0, 0, 0, 2, -1, -30])
                missed = draw.choice([0, 0, 0, skipped]) if skipped > 0 else 0
                sequence, time = sequence + number + skipped, time + (number + skipped) * 5_000_000
                rows.append(tick(sequence, time + draw.choice([0, 0, 0, 10**9]), number * 5_000_000, number, missed, int(draw.random() < 0.03)))
            ticks = np.concatenate(rows)
            whole, single = isotherm.FirstWins(), isotherm.FirstWins()
            batches, at = [], 0
            while at < len(ticks):
                length = draw.randint(1, 16)
                batches.append(whole.choose(ticks[at : at + length]))
                at += length
            alone = np.concatenate([single.choose(row) for row in rows])
            np.testing.assert_array_equal(np.concatenate(batches), alone, f"seed {seed}")
            accounts = isotherm.Account(), isotherm.Account()
            for batch in batches:
                accounts[0].enter(batch)
            for row in alone:
                accounts[1].enter(row.reshape(1))
            self.assertEqual(accounts[0], accounts[1], f"seed {seed}")


if __name__ == "__main__":
    unittest.main()
