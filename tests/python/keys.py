"""isotherm-replay play at a terminal: what the keys do, and that the terminal is given back.

keys.py PROGRAM LOG MAPPING LOCATOR; the log is of 100 Hz and a minute. Standard library only.
"""

import json
import os
import pty
import re
import select
import signal
import sys
import termios
import time

PROGRAM, LOG, MAPPING, LOCATOR = sys.argv[1:]
LIMIT = 30.0
LEFT, RIGHT = b"\x1b[D", b"\x1b[C"


class Player:
    """The program with a terminal of its own."""

    def __init__(self, *options):
        self.pid, self.terminal = pty.fork()
        if self.pid == 0:
            arguments = ["play", LOG, "-m", MAPPING, "-u", "MEMS-0001", "--connect", LOCATOR, "--json"]
            os.environ["COLUMNS"] = "160"
            os.execv(PROGRAM, [PROGRAM, *arguments, *options])
        self.text = ""
        self.echo = None

    def read(self, seconds):
        """Takes what is written meanwhile; false once the program has ended."""
        try:
            self.echo = bool(termios.tcgetattr(self.terminal)[3] & termios.ECHO)
            if select.select([self.terminal], [], [], seconds)[0]:
                piece = os.read(self.terminal, 65536)
                self.text += piece.decode(errors="replace")
                return bool(piece)
            return True
        except (OSError, termios.error):
            return False

    def until(self, pattern, behind=0):
        """Waits until something is shown behind a place in the text; the place behind it."""
        deadline = time.monotonic() + LIMIT
        while True:
            found = re.compile(pattern).search(self.text, behind)
            if found:
                return found.end()
            if time.monotonic() > deadline or not self.read(0.05):
                sys.exit("%r is not shown behind %r" % (pattern, self.text[behind:]))

    def flow(self):
        """Waits until a few more ticks have gone out than are shown now."""
        shown = lambda: int(([0] + re.findall(r"(\d+) ticks", self.text))[-1])
        goal, deadline = shown() + 5, time.monotonic() + LIMIT
        while shown() < goal:
            if time.monotonic() > deadline or not self.read(0.05):
                sys.exit("nothing goes out any more: %r" % self.text)

    def press(self, keys):
        place = len(self.text)
        os.write(self.terminal, keys)
        return place

    def end(self, code):
        """Waits for the end; the summary."""
        deadline = time.monotonic() + LIMIT
        while self.read(0.05):
            if time.monotonic() > deadline:
                os.kill(self.pid, signal.SIGKILL)
                sys.exit("it does not end: %r" % self.text)
        _, status = os.waitpid(self.pid, 0)
        if os.waitstatus_to_exitcode(status) != code:
            sys.exit("exit code %d: %r" % (os.waitstatus_to_exitcode(status), self.text))
        # What takes the bar away may stand before it on its line.
        return json.loads(re.findall(r"\{.*\}", self.text)[-1])


def check(holds, what):
    if not holds:
        sys.exit("does not hold: %s" % (what,))


# Space pauses, n and the right arrow play one gyro batch each, space goes on, q ends in order.
player = Player()
player.until(r"space pause")
player.flow()
check(player.echo is False, "keys are taken at once")
player.until(r"(\d+) ticks  paused", player.press(b" "))
at = int(re.findall(r"(\d+) ticks  paused", player.text)[-1])
player.until(r" %d ticks  paused" % (at + 1), player.press(b"n"))
player.until(r" %d ticks  paused" % (at + 2), player.press(RIGHT))
player.until(r"\d+ ticks  \d", player.press(b" "))
player.until(r"of 2 ", player.press(b"+"))
player.until(r"of 1 ", player.press(b"-"))
player.press(b"q")
summary = player.end(0)
check(summary["ticks_lost"] == 0 and summary["ticks_under_way"] == 0 and not summary["stopped"], summary)
check(summary["ticks_sent"] == summary["ticks_acknowledged"] >= at + 2, summary)
check(summary["paused_s"] > 0, summary)

# On by 10 s in the same run, what is passed over announced; back by 10 s in a new one.
player = Player()
player.flow()
for keys, seconds in ((RIGHT, r"1\d"), (b"]", r"2\d"), (b"[", r"1\d"), (LEFT, r" \d")):
    player.until(seconds + r"\.\d+ s  ", player.press(keys))
    player.flow()
player.press(b"q")
summary = player.end(0)
unit = summary["units"][0]
check(summary["seeks"] == 4 and unit["runs"] == 3 and unit["restarts"] == 2, summary)
check(unit["ticks_not_sent"] == unit["ticks_announced_missing"] > 1900, summary)
check(unit["ticks_lost"] == 0, summary)

# On by 10 s within a gap of 30 s: what stands behind it first goes out too.
with open(LOG) as log:
    lines = log.readlines()
whole, LOG = LOG, LOG.replace(".csv", "-gap.csv")
with open(LOG, "w") as log:
    log.writelines(lines[:101] + lines[3101:3201])
player = Player()
player.until(r"0\.9\d s  ")
time.sleep(0.5)
player.press(RIGHT)
summary = player.end(0)
check(summary["seeks"] == 1 and summary["ticks_sent"] == 199, summary)
check(summary["temperature_readings_sent"] == 16, summary)
LOG = whole

# Ctrl-C, and signals of others, also while playing is paused.
for stop in (b"\x03", signal.SIGTERM, signal.SIGINT):
    player = Player()
    player.flow()
    player.until(r"\d+ ticks  paused", player.press(b" "))
    if isinstance(stop, bytes):
        player.press(stop)
    else:
        os.kill(player.pid, stop)
    summary = player.end(1)
    check(summary["stopped"], summary)
    check(player.echo is True, "the terminal is as it was")
print("keys: as they should")
