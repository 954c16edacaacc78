"""Tries the playground in a real browser.

    python3 playground/tests/browser.py [--server n3p-play] [--file n3p.html] [--pictures FOLDER]

Drags, switches, loads, saves, links, keys, errors, a phone's width and the dark, by the server, by the page
that plans in the browser, or by both. With --pictures it leaves what it saw.
"""

import argparse
import json
import math
import subprocess
import sys
import time
from pathlib import Path

from chromium import Chromium, Failed

EXAMPLES = Path(__file__).parent.parent / "examples"
# A plan for every picture of a smooth film would be 60 a second; half of that is what is promised.
LEAST_RATE = 30


class Tries:
    def __init__(self, browser: Chromium, address: str, pictures: Path | None, name: str, others: list[int]):
        self.browser, self.address, self.pictures, self.name = browser, address, pictures, name
        # Programs that plan for the page.
        self.others = others
        self.taken = 0

    def picture(self, what: str):
        if self.pictures:
            self.taken += 1
            self.browser.picture(self.pictures / f"{self.name}-{self.taken:02}-{what}.png")

    # What the page shows.

    def text(self, element: str) -> str:
        return self.browser.run(f"document.getElementById({element!r}).textContent")

    def scene(self) -> dict:
        return self.browser.run("lot.scene")

    def settle(self):
        """Until the page has planned what is on it."""
        self.browser.run("follower.follow(), 0")
        self.browser.wait("!follower.busy")

    def where(self, expression: str):
        """Where a point of the world is in the window."""
        return self.browser.run(f"""(() => {{
            const [x, y] = {expression}, box = picture.svg.getBoundingClientRect(), v = picture.view;
            return [box.left + box.width / 2 + (x - v.x) * v.scale, box.top + box.height / 2 - (y - v.y) * v.scale];
        }})()""")

    def fresh(self, address: str | None = None):
        self.browser.open(address or self.address)
        self.settle()

    def no_message(self):
        assert self.browser.run("document.getElementById('message').hidden"), self.text("message")

    # The tries.

    def shows_a_plan(self):
        self.fresh()
        assert self.browser.run("picture.plans[0].path.poses.length") > 50
        assert self.text("time-a").endswith(("µs", "ms")) and self.text("length-a").endswith(" m")
        assert self.text("changes-a").isdigit() and self.text("route-a")
        self.no_message()
        self.picture("light")

    def follows_a_drag(self):
        """The plan follows the start, thirty times a second or more."""
        self.fresh()
        length = self.text("length-a")
        rates = [self.rates() for _ in range(3)]
        told = ", ".join(f"{by_clock:.0f} ({by_core:.0f})" for by_clock, by_core in rates)
        print(f"  plans a second (of one core's time): {told}")
        self.settle()
        assert self.text("length-a") != length
        # Each drag is one step.
        assert self.browser.run("lot.past.length") == 3
        for _ in range(3):
            self.browser.key("z", 90, modifiers=2)
        self.settle()
        assert self.text("length-a") == length
        self.browser.drag(self.around()[::5], lambda i: i % 4 or self.picture("drag"))
        # Other programs may want the same cores: what counts is the time that the browser had.
        assert max(by_core for _, by_core in rates) >= LEAST_RATE, told
        assert max(by_clock for by_clock, _ in rates) >= LEAST_RATE / 3, told

    def around(self):
        """Where to drag the start: once and a half around, a move every refresh of a screen."""
        x, y = self.where("along(lot.scene.start, middleOf(lot.scene.vehicle))")
        turn = math.tau / 75
        return [(x + 40 * math.sin(i * turn), y + 12 * (1 - math.cos(i * turn))) for i in range(113)]

    def rates(self) -> tuple[float, float]:
        """Plans a second while the start is dragged, 60 moves a second: by the clock, and by the processor time of
        the browser, all its drawing included, and of the server."""
        points = self.around()
        taken = lambda: self.browser.processor_seconds(*self.others)
        begun, before, taken_before = time.monotonic(), self.browser.run("rate.total"), taken()

        def between(i):
            time.sleep(max(0.0, begun + (i + 1) / 60 - time.monotonic()))

        self.browser.drag(points, between)
        seconds, spent = time.monotonic() - begun, taken() - taken_before
        plans = self.browser.run("rate.total") - before
        return plans / seconds, plans / spent

    def moves_cars_and_turns_them(self):
        self.fresh()
        before = self.scene()
        x, y = self.where("centreOf(lot.scene.obstacles[0])")
        self.browser.drag([(x, y), (x + 5, y + 5), (x + 30, y + 60)])
        after = self.scene()
        assert after["obstacles"][0] != before["obstacles"][0] and after["start"] == before["start"]
        tip = self.where("picture.turningHandle(lot.scene, picture.selected, 26 / picture.view.scale).tip")
        self.browser.drag([tip, (tip[0] + 20, tip[1] + 5), (tip[0] + 50, tip[1] + 40)])
        assert self.scene()["obstacles"][0] != after["obstacles"][0]
        count = len(after["obstacles"])
        self.browser.run("document.getElementById('add-car').click()")
        assert len(self.scene()["obstacles"]) == count + 1
        self.browser.run("document.getElementById('add-wall').click()")
        corner = self.browser.run("(() => { const b = picture.svg.getBoundingClientRect(); return [b.left + 120, b.bottom - 60]; })()")
        self.browser.drag([corner, (corner[0] + 50, corner[1]), (corner[0] + 100, corner[1] - 5)])
        walls = [o for o in self.scene()["obstacles"] if len(o) == 2]
        assert len(self.scene()["obstacles"]) == count + 2 and walls, "no wall was drawn"
        self.picture("added")
        self.browser.key("Delete", 46)
        self.browser.key("z", 90, modifiers=2)
        assert len(self.scene()["obstacles"]) == count + 2
        self.settle()

    def changes_the_bounds(self):
        """By pointer, by key, undone, saved and in a link; what they leave out is told."""
        self.fresh()
        before = self.scene()["bounds"]
        middle = lambda side: self.where(f"((b) => [[b[0], (b[1] + b[3]) / 2], [(b[0] + b[2]) / 2, b[3]]][{side}])(lot.scene.bounds)")
        x, y = middle(1)
        self.browser.drag([(x, y), (x + 4, y - 5), (x + 9, y - 30)])
        after = self.scene()["bounds"]
        assert after[:3] == before[:3] and after[3] > before[3] + 0.5, (before, after)
        assert self.browser.run("lot.past.length") == 1, "a drag is one step"
        # Where two sides meet, both.
        self.browser.run("picture.view.scale = 14, picture.view.x = lot.scene.bounds[2] - 5, picture.look()")
        corner = self.where("[lot.scene.bounds[2], lot.scene.bounds[3]]")
        self.browser.drag([corner, (corner[0] - 5, corner[1] + 3), (corner[0] - 14, corner[1] + 7)])
        both = self.scene()["bounds"]
        assert both[:2] == after[:2] and abs(both[2] - after[2] + 1) < 0.2 and abs(both[3] - after[3] + 0.5) < 0.2, (after, both)
        self.settle()
        self.picture("bounds")
        # Keys: B goes from side to side, arrows move the one that is selected, and no other.
        self.browser.run("edit.select(null), document.getElementById('fit').focus()")
        self.browser.key("b", 66)
        assert self.browser.run("document.activeElement.getAttribute('aria-label')").startswith("Left bound at")
        self.browser.key("ArrowLeft", 37, modifiers=8)
        self.browser.key("ArrowUp", 38)
        moved = self.scene()["bounds"]
        assert abs(moved[0] - both[0] + 1) < 1e-9 and moved[1:] == both[1:], (both, moved)
        assert self.browser.run("document.getElementById('turn-left').disabled")
        self.browser.key("b", 66)
        assert self.browser.run("picture.selected.index") == 1
        # No side passes the other.
        for _ in range(40):
            self.browser.key("ArrowUp", 38, modifiers=8)
        _, low, _, high = self.scene()["bounds"]
        assert abs(high - low - 2) < 1e-9, (low, high)
        self.settle()
        assert "bounds" in self.text("message"), self.text("message")
        self.picture("outside")
        while self.scene()["bounds"] != moved:
            self.browser.key("z", 90, modifiers=2)
        self.settle()
        self.no_message()
        # In a file and in a link.
        self.browser.run("document.getElementById('save').click()")
        assert self.downloaded(f"{self.scene()['name']}.json")["bounds"] == moved
        self.browser.run("document.getElementById('link').click()")
        self.browser.wait("location.hash.startsWith('#lot=')")
        self.fresh(self.browser.run("location.href"))
        assert self.scene()["bounds"] == moved
        # Deleted, and added again around all there is.
        self.browser.run("document.getElementById('add-bounds').click()")
        self.browser.key("Delete", 46)
        assert self.scene()["bounds"] is None and not self.browser.run("document.querySelectorAll('#bounds .thing').length")
        self.browser.run("document.getElementById('add-bounds').click()")
        self.settle()
        left, low, right, high = self.scene()["bounds"]
        assert all(left < x < right and low < y < high for o in self.scene()["obstacles"] for x, y in o)
        self.no_message()

    def switches(self):
        self.fresh()
        first = self.text("length-a")
        self.browser.choose("method", "ha")
        self.settle()
        assert self.text("name-a") == "Hybrid A*" and self.text("length-a") != first
        assert int(self.text("steps-a").replace(",", "")) > 100
        self.browser.choose("method", "n3p")
        self.browser.choose("compare", "ha")
        self.settle()
        assert self.browser.run("picture.plans.length") == 2 and self.text("time-b")
        self.picture("compare")
        self.browser.choose("compare", "")
        self.browser.choose("margin", "0.3")
        self.settle()
        assert self.text("margin-shown") == "30 cm"
        self.browser.choose("steering", "at-changes")
        self.settle()
        self.picture("continuous")
        assert self.browser.run("picture.plans[0].path?.poses.length > 20") or self.text("message")
        self.browser.choose("vehicle", "1")
        self.settle()
        assert self.scene()["vehicle"]["length"] == 3.6

    def plays(self):
        self.fresh()
        self.browser.wait("!document.getElementById('play-button').disabled")
        self.browser.run("document.getElementById('play-button').click()")
        self.browser.wait("Number(document.getElementById('play-time').value) > 1.5")
        self.picture("playing")
        assert "m/s" in self.text("play-state") or "wheels" in self.text("play-state"), self.text("play-state")
        self.browser.choose("play-time", "1000")
        assert "parked" in self.text("play-state")
        end = self.browser.run("document.getElementById('moving').getAttribute('transform')").split("(")[1].split(")")[0]
        goal = self.scene()["goal"]
        assert all(abs(a - b) < 1e-3 for a, b in zip(map(float, end.split()), goal)), (end, goal)

    def every_example(self):
        self.fresh()
        for i in range(self.browser.run("catalogue.examples.length")):
            self.browser.choose("example", str(i))
            self.settle()
            self.no_message()
            assert self.browser.run("Boolean(picture.plans[0].path)"), i
            self.picture(f"example-{i}")

    def loads_and_saves(self):
        self.fresh()
        self.browser.files("file", EXAMPLES / "parallel.json")
        self.browser.wait("lot.scene.name === 'parallel'")
        self.settle()
        self.browser.run("document.getElementById('save').click()")
        saved = self.downloaded("parallel.json")
        given = json.loads((EXAMPLES / "parallel.json").read_text())
        assert all(saved[key] == given[key] for key in ("start", "goal", "obstacles", "vehicle")), saved
        self.browser.run("document.getElementById('save-path').click()")
        path = self.downloaded("parallel.n3p.json")
        assert path["poses"][0] == given["start"] and path["poses"][-1] == given["goal"]
        wrong = Path(self.browser.downloads) / "wrong.json"
        wrong.write_text('{"start": [0, 0]}')
        self.browser.files("file", wrong)
        self.browser.wait("!document.getElementById('message').hidden")
        assert self.text("message").startswith("Start is"), self.text("message")
        assert self.scene()["name"] == "parallel", "a bad file leaves what was there"
        self.picture("bad-file")
        case = Path(self.browser.downloads) / "Case7.csv"
        case.write_text("0,0,0,12,4,1.57,1,4,3,3,5,3,5,6,3,6")
        self.browser.files("file", case)
        self.browser.wait("lot.scene.name === 'Case7'")

    def downloaded(self, name: str) -> dict:
        file = Path(self.browser.downloads) / name
        for _ in range(200):
            if file.exists():
                return json.loads(file.read_text())
            time.sleep(0.05)
        raise Failed(f"{name} was not saved")

    def links(self):
        self.fresh()
        self.browser.choose("method", "ha-rs")
        x, y = self.where("lot.scene.start")
        self.browser.drag([(x, y), (x - 10, y), (x - 20, y - 5)])
        self.settle()
        scene = self.scene()
        self.browser.run("document.getElementById('link').click()")
        self.browser.wait("location.hash.startsWith('#lot=')")
        link = self.browser.run("location.href")
        self.fresh(link)
        again = self.scene()
        assert again["start"] == scene["start"] and again["obstacles"] == scene["obstacles"]
        assert self.browser.run("document.getElementById('method').value") == "ha-rs"
        print(f"  a link of {len(link)} characters")
        self.fresh(link[:-40])
        assert "link" in self.text("message"), self.text("message")
        assert self.browser.run("picture.plans.length") == 1, "the page is there all the same"

    def keys(self):
        self.fresh()
        start = self.scene()["start"]
        self.browser.run("document.getElementById('start').focus()")
        self.browser.key("ArrowRight", 39)
        assert abs(self.scene()["start"][0] - start[0] - 0.1) < 1e-9
        self.browser.key("ArrowUp", 38, modifiers=8)
        assert abs(self.scene()["start"][1] - start[1] - 1) < 1e-9
        self.browser.key("q", 81)
        assert abs(self.scene()["start"][2] - start[2] - math.radians(2)) < 1e-9
        for _ in range(3):
            self.browser.key("z", 90, modifiers=2)
        assert self.scene()["start"] == start
        # Tab reaches the cars, and everything else there is.
        self.browser.run("document.getElementById('fit').focus()")
        labels = []
        for _ in range(8):
            self.browser.key("Tab", 9)
            labels.append(self.browser.run("document.activeElement.getAttribute('aria-label') ?? document.activeElement.id"))
        assert sum(map(lambda label: label.startswith(("Parked", "Wall", "Obstacle", "Goal", "Start")), labels)) >= 6, labels
        names = self.browser.run("""[...document.querySelectorAll('button, select, input, [tabindex="0"]')]
            .filter((e) => !(e.getAttribute('aria-label') || e.textContent.trim() || e.closest('label') || e.hidden)).map((e) => e.outerHTML)""")
        assert not names, names
        self.picture("keyboard")

    def errors(self):
        self.fresh()
        self.browser.run("edit.commit({ ...lot.scene, start: [...centreOf(lot.scene.obstacles[0]), 0] })")
        self.settle()
        assert "deep in an obstacle" in self.text("message"), self.text("message")
        assert self.browser.run("document.getElementById('start').classList.contains('wrong')")
        assert self.browser.run("document.querySelector('#obstacles .wrong') === document.querySelector('#obstacles').firstChild")
        self.picture("start-in-collision")
        self.browser.key("z", 90, modifiers=2)
        self.settle()
        self.no_message()
        # Walled in.
        self.browser.run("""edit.commit({ ...lot.scene, obstacles: [...lot.scene.obstacles,
            ...[[-7, -7, 7, -7], [7, -7, 7, 3.6], [7, 3.6, -7, 3.6], [-7, 3.6, -7, -7]].map(([a, b, c, d]) => [[a, b], [c, d]])] })""")
        self.settle()
        assert self.text("message").startswith("No path"), self.text("message")
        self.picture("no-path")

    def explains(self):
        self.fresh()
        self.browser.run("document.getElementById('tour-open').click()")
        self.browser.wait("picture.plans[0].tried")
        for step in range(5):
            time.sleep(0.6)
            self.picture(f"tour-{step}")
            if step == 3:
                assert "tried" in self.text("tour-text"), self.text("tour-text")
                time.sleep(2.5)
                self.picture("tour-3-later")
            self.browser.run("document.getElementById('tour-next').click()")
        self.settle()
        assert self.browser.run("document.getElementById('tour').hidden && picture.plans.length === 2")

    def on_a_phone(self):
        self.browser.size(360, 740, touch=True)
        self.fresh()
        overflow = self.browser.run("document.documentElement.scrollWidth")
        assert overflow <= 360, f"{overflow} pixels wide"
        self.picture("phone")
        self.browser.run("document.getElementById('tour-open').click()")
        self.browser.run("document.getElementById('tour-next').click()")
        time.sleep(0.4)
        self.picture("phone-tour")
        self.browser.run("document.getElementById('tour-close').click()")
        self.browser.run("document.getElementById('panel').scrollIntoView()")
        self.picture("phone-panel")
        # Two fingers apart.
        scale = self.browser.run("picture.view.scale")
        self.browser.run("scrollTo(0, 0)")
        box = self.browser.run("(() => { const b = picture.svg.getBoundingClientRect(); return [b.left + b.width / 2, b.top + b.height / 2]; })()")
        touch = lambda kind, *xs: self.browser.call("Input.dispatchTouchEvent", type=kind,
                                                    touchPoints=[{"x": box[0] + x, "y": box[1] + 60, "id": i} for i, x in enumerate(xs)])
        touch("touchStart", -30)
        touch("touchStart", -30, 30)
        for apart in (40, 55, 70):
            touch("touchMove", -apart, apart)
        touch("touchEnd")
        assert self.browser.run("picture.view.scale") > 1.4 * scale
        self.browser.size(1280, 800)

    def in_the_dark(self):
        self.browser.dark(True)
        self.fresh()
        self.picture("dark")
        colour = self.browser.run("getComputedStyle(document.body).backgroundColor")
        assert max(map(int, colour[4:-1].split(","))) < 60, colour
        self.browser.choose("compare", "ha-rs")
        self.settle()
        self.picture("dark-compare")
        self.browser.dark(False)

    ALL = [shows_a_plan, follows_a_drag, moves_cars_and_turns_them, changes_the_bounds, switches, plays, every_example, loads_and_saves, links,
           keys, errors, explains, on_a_phone, in_the_dark]


def attempt(address: str, name: str, pictures: Path | None, only: str | None, others: list[int]) -> int:
    print(f"{name}:")
    failed = 0
    browser = Chromium()
    try:
        for one in Tries.ALL:
            if only and only not in one.__name__:
                continue
            tries = Tries(browser, address, pictures, f"{name}-{one.__name__}", others)
            try:
                one(tries)
                assert not browser.complaints, browser.complaints
                print(f"ok {one.__name__}")
            except (AssertionError, Failed) as error:
                failed += 1
                print(f"FAILED {one.__name__}: {error or 'an assertion'}; the browser says {browser.complaints}")
                if not str(error):
                    import traceback
                    traceback.print_exc()
                tries.picture("failed")
            browser.complaints.clear()
    finally:
        browser.close()
    return failed


def main() -> int:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--server", type=Path, help="the program n3p-play")
    arguments.add_argument("--file", type=Path, help="the page that plans in the browser")
    arguments.add_argument("--pictures", type=Path, help="a folder for what is seen")
    arguments.add_argument("--only", help="tries whose names hold this")
    given = arguments.parse_args()
    if given.pictures:
        given.pictures.mkdir(parents=True, exist_ok=True)
    failed = 0
    if given.server:
        server = subprocess.Popen([given.server, "--port", "0"], stdout=subprocess.PIPE, text=True)
        try:
            failed += attempt(server.stdout.readline().strip(), "server", given.pictures, given.only, [server.pid])
        finally:
            server.terminate()
            server.wait()
    if given.file:
        failed += attempt(given.file.resolve().as_uri(), "file", given.pictures, given.only, [])
    print("all is well" if not failed else f"{failed} failed")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
