"""Verdicts on sizes of garments against truth from geometry alone: python3 sizes.py OVERCOAT FOLDER

OVERCOAT is the program, FOLDER a new folder; it needs numpy. Six invented people are scanned bare, and four sizes each of
trousers, a T-shirt and a skirt, all cut for the first of them, are tried on by two people each. Then four sizes of trousers,
P1 < P2 < P3 < P4 as in Shi 2020, are tried on by the person for whom they were cut and, if OVERCOAT_FOREIGN names the folder
of the foreign scans, by its man and woman. Printed is a table in Markdown, a `!` beside each wrong verdict, and figures.

The truth, fixed before any verdict was seen. It knows neither the figure that the program fits nor the simulated cloth, only
the true body, the garment as made, and the person for whom it was made:
 1. A girth of the body is the convex hull of a horizontal section: a tape bridges hollows. Chest: the largest in the 10 cm
    below the armpits. Waist: at 0.626 of stature. Hip: where the seat is rearmost. Thigh: 2.5 cm below the crotch.
 2. A girth of the garment is the length of its own section or rim. A bottom hangs from its band, which lies at the same
    share of stature on everyone; a top hangs from the shoulders, so at the same distance from the armpits. Lengths from
    there on are the garment's. Chest: 1 cm below the armholes. Thigh: not above 1 cm below the fork.
 3. Ease is the garment's girth less the body's. A knit gives 10 % of its girth (of its usual 5 to 15 %), a weave 2 %.
 4. Too tight: at some place the ease is less than minus what the cloth gives. Bottoms: band, hip, thigh; tops: chest, hem.
    Slides down: not too tight, and its band is longer than the girth of the hip. It fits otherwise.
 5. The best size is the smallest that fits, by the truth and by the verdicts.
 6. The margin is how far, in girth, the garment is from another true verdict: below 1 cm it could be either.
 7. Printed ease is compared at chest, waist, hip and thigh, where the garment truly fits; that of a waist above the band with
    that of the band. The gap is ease / 2 pi. Upper arms are left out of both.
"""
import json, os, subprocess, sys
import numpy as np
from pathlib import Path

from ply import read_ply

SEEDS = [31586, 31587, 31588, 31589, 31590, 31591]
MADE_FOR = 31586  # whose M the sizes are graded from
TRIED = [("trousers", "wool", SEEDS[0:2]), ("tshirt", "jersey", SEEDS[2:4]), ("skirt", "wool", SEEDS[4:6])]
SIZES = ["S", "M", "L", "XL"]
SHI_MADE_FOR, SHI_SIZES = 4304, ["XXS", "S", "M", "XXL"]  # by the truth too tight, twice fitting, and sliding down on all three
GIVES = {"jersey": 0.10, "wool": 0.02}  # share of its girth by which cloth may be stretched
LONGER = {"trousers": 1.02, "tshirt": 1.02, "skirt": 1.0}  # cloth along the body, relative to the person on whom it is cut
FOREIGN, TAU = os.environ.get("OVERCOAT_FOREIGN"), 2 * np.pi
STEP = 0.005  # metres between levels that are searched
TIGHT, FITS, SLIDES = "too tight", "fits", "slides down"
TAPES = ["chest", "waist", "hip", "thigh"]  # where printed ease is compared; a band is printed where it rests
VERDICTS = {"too_tight": TIGHT, "stretched": TIGHT, "slides_down": SLIDES, "fits": FITS}


def read_obj(path):
    """Vertices in metres, and triangles, of a garment's file in centimetres."""
    of = lambda mark: [line.split()[1:4] for line in Path(path).read_text().splitlines() if line.startswith(mark + " ")]
    return np.array(of("v"), float) / 100, np.array([[int(x.split("/")[0]) - 1 for x in face] for face in of("f")])


def ring_length(points):
    return np.linalg.norm(points - np.roll(points, 1, axis=0), axis=1).sum()


def rings(mesh, y):
    """Closed rings of the horizontal section at a height, the longest first."""
    v, f = mesh
    above = v[:, 1] > y
    count, place, after = above[f].sum(1), {}, {}
    for face in f[(count > 0) & (count < 3)].tolist():
        # Each section runs from where its face's outline comes up through the level to where it goes down.
        way = {}
        for a, b in zip(face, face[1:] + face[:1]):
            if above[a] != above[b]:
                key = way[bool(above[b])] = (min(a, b), max(a, b))
                low, high = v[key[0]], v[key[1]]
                place[key] = low + (high - low) * (y - low[1]) / (high[1] - low[1])
        after[way[True]] = way[False]
    return sorted((np.array([place[key] for key in ring]) for ring in closed(after)), key=ring_length, reverse=True)


def rims(mesh):
    """Boundary rings, the highest first."""
    v, f = mesh
    edges = {edge for face in f.tolist() for edge in zip(face, face[1:] + face[:1])}
    found = closed({a: b for a, b in edges if (b, a) not in edges})
    return sorted((v[ring] for ring in found), key=lambda ring: -ring[:, 1].mean())


def closed(after):
    """The rings that lead back to their beginning; given is what comes after each place."""
    found = []
    while after:
        ring, at = [], (begin := next(iter(after)))
        while at in after:
            ring.append(at)
            at = after.pop(at)
        found += [ring] if at == begin else []
    return found


def longest(mesh, y):
    """Length of the longest closed ring at a height; 0 without one."""
    return next(map(ring_length, rings(mesh, y)), 0.0)


def tape(mesh, y):
    """Girth at a height: the hull of the longest ring."""
    points, hull = sorted(rings(mesh, y)[0][:, [0, 2]].tolist()), []
    turn = lambda o, a, b: (a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0])
    for side in (points, points[::-1]):
        chain = []
        for p in side:
            while len(chain) > 1 and turn(chain[-2], chain[-1], p) <= 0:
                chain.pop()
            chain.append(p)
        hull += chain[:-1]
    return ring_length(np.array(hull))


def parting(mesh, levels):
    """The first level at which the longest ring is another than before: limbs join or part."""
    lengths = [longest(mesh, y) for y in levels]
    return next(y for y, a, b in zip(levels[1:], lengths, lengths[1:]) if not 0.8 * a < b < 1.25 * a)


class Body:
    """Levels and girths of a true body in its A-pose, upright, its feet at the lowest level."""

    def __init__(self, path):
        v, _, faces = read_ply(path)
        self.mesh = v, faces
        self.low, self.stature = v[:, 1].min(), np.ptp(v[:, 1])
        self.crotch = parting(self.mesh, np.arange(self.at(0.60), self.at(0.35), -STEP))
        self.armpit = parting(self.mesh, np.arange(self.at(0.66), self.at(0.85), STEP))
        seat = v[(abs(v[:, 0]) < 0.2) & (v[:, 1] > self.crotch) & (v[:, 1] < self.crotch + 0.15)]
        chests = np.arange(self.armpit - 0.10, self.armpit - 0.009, STEP)
        chest, hip = max(chests, key=lambda y: tape(self.mesh, y)), seat[seat[:, 2].argmin(), 1]
        self.level = {"chest": chest, "waist": self.at(0.626), "hip": hip, "thigh": self.crotch - 0.025}

    def at(self, share):
        return self.low + share * self.stature


class Garment:
    """A garment as made, and where it lies on a person."""

    def __init__(self, path, kind, fabric, made_for):
        self.mesh, self.kind, self.fabric = read_obj(path), kind, fabric
        self.longer, self.made_for = LONGER[kind], made_for
        self.is_top, found = kind == "tshirt", rims(self.mesh)
        self.end, self.end_name = (found[-1], "hem") if self.is_top else (found[0], "band")
        low, high = self.mesh[0][:, 1].min(), self.mesh[0][:, 1].max()
        # Where sleeves or legs begin; a skirt has neither.
        levels = np.arange(low + 0.15, high, STEP) if self.is_top else np.arange(high - 0.05, low, -STEP)
        self.fork = low if kind == "skirt" else parting(self.mesh, levels)

    def girths(self, person):
        """Of each place where the garment goes around a person: its own girth and the person's."""
        end = self.end[:, 1].mean() / self.longer
        band = person.at((end - self.made_for.low) / self.made_for.stature)
        lower = self.made_for.armpit - person.armpit if self.is_top else end - band
        found = {self.end_name: (ring_length(self.end), tape(person.mesh, end - lower))}
        for name, y in person.level.items():
            at = self.longer * (y + lower)
            if name == ("chest" if self.is_top else "thigh"):
                at = min(at, self.fork - 0.01)
            own = longest(self.mesh, at)
            if name == "waist" and not self.is_top and y >= end - lower:
                own = found["band"][0]
            if own > 0 and (name != "thigh" or self.kind == "trousers"):
                found[name] = (own, tape(person.mesh, y))
        return found

    def truth(self, girths):
        """The verdict and its margin."""
        places = ("chest", "hem") if self.is_top else ("band", "hip", "thigh")
        spare = min(own * (1 + GIVES[self.fabric]) - body for name, (own, body) in girths.items() if name in places)
        if spare < 0:
            return TIGHT, -spare
        wide = -1.0 if self.is_top else girths["band"][0] - girths["hip"][1]
        return (SLIDES, wide) if wide > 0 else (FITS, min(spare, -wide))


def run(program, *arguments):
    done = subprocess.run([program, "--json", *map(str, arguments)], capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, done.args))}\n{done.stdout}{done.stderr}")
    return json.loads(done.stdout)


def try_on(program, folder, person, body, garments):
    """Puts sizes on a person and prints their lines. Of each: the truth, the verdict, and printed less true eases, metres."""
    kind, fabric = next((garment.kind, garment.fabric) for _, garment in garments.values())
    sizes = [f"--size={size}={path}" for size, (path, _) in garments.items()]
    picture = folder / f"{'-'.join([kind, *garments, str(person)])}.png"
    said = run(program, "-C", folder / f"session-{person}", "tryon", *sizes, "--fabric", fabric, "--picture", picture)
    tried = []
    for (size, (_, garment)), one in zip(garments.items(), said["sizes"]):
        girths = garment.girths(body)
        truth, margin = garment.truth(girths)
        true = {name: own - around for name, (own, around) in girths.items()}
        printed = {girth["name"]: girth["own"] - girth["body"] for girth in one["girths"]}
        verdict = VERDICTS[next(iter([one["verdict"]] if isinstance(one["verdict"], str) else one["verdict"]))]
        cm = lambda eases, name: f"{100 * eases[name]:+.1f}" if name in eases else "–"
        eases = ", ".join(f"{name} {cm(printed, name)} / {cm(true, name)}" for name in {**true, **printed})
        text = one["verdict_text"] + (" !" if verdict != truth else "")
        print(f"| {kind}, {fabric} | {person} | {size} | {eases} | {truth} | {100 * margin:.1f} | {text} |", flush=True)
        off = [printed[name] - true[name] for name in TAPES if name in printed and name in true and truth == FITS]
        tried.append((truth, verdict, off))
    return tried


def main(program, folder):
    folder.mkdir(parents=True)
    scans, bodies = {}, {}
    for seed in [*SEEDS, SHI_MADE_FOR]:
        made = folder / f"person-{seed}"
        run(program, "studio", "make", "--seed", seed, "--garments", "", "--no-frames", "--out", made)
        scans[seed], bodies[seed] = made / "0-body.ply", Body(made / "truth" / "bind_body.ply")
    for name in ("man", "woman") if FOREIGN else ():
        scans[name], bodies[name] = Path(FOREIGN, name, "0-body.ply"), Body(Path(FOREIGN, name, "truth", "bind_body.ply"))
    for person, scan in scans.items():
        run(program, "new", folder / f"session-{person}")
        run(program, "-C", folder / f"session-{person}", "scan", "body", scan)
        run(program, "-C", folder / f"session-{person}", "build")

    def sewn(kind, fabric, made_for, sizes):
        out = folder / f"{kind}-{made_for}"
        run(program, "studio", "garment", "--kind", kind, "--seed", made_for, "--sizes", ",".join(sizes), "--out", out)
        paths = {size: out / f"{kind}-{size}.obj" for size in sizes}
        return {size: (path, Garment(path, kind, fabric, bodies[made_for])) for size, path in paths.items()}

    print("| garment | person | size | ease, cm: printed / true | truth | margin, cm | verdict |\n|---|---|---|---|---|---|---|")
    graded, shi = [], []
    for kind, fabric, people in TRIED:
        garments = sewn(kind, fabric, MADE_FOR, SIZES)
        graded += [try_on(program, folder, person, bodies[person], garments) for person in people]
    garments = dict(zip(("P1", "P2", "P3", "P4"), sewn("trousers", "wool", SHI_MADE_FOR, SHI_SIZES).values()))
    people = [name for name in bodies if name not in SEEDS]
    shi += [try_on(program, folder, person, bodies[person], garments) for person in people]

    right = lambda groups: sum(truth == verdict for tried in groups for truth, verdict, _ in tried)
    count = lambda groups: sum(map(len, groups))
    best = lambda verdicts: [*verdicts, FITS].index(FITS)  # a size after all others stands for none that fits
    steps = [abs(best([row[0] for row in tried]) - best([row[1] for row in tried])) for tried in graded]
    off = 1e3 * np.abs(sum((off for tried in graded + shi for *_, off in tried), []))
    print(
        f"\n{right(graded)} of {count(graded)} verdicts right; best size off by {', '.join(map(str, steps))} sizes; P1 to P4 "
        f"{right(shi)} of {count(shi)} right; printed ease off by {off.mean():.1f} mm of girth on average, at most "
        f"{off.max():.1f}, so the gap by {off.mean() / TAU:.1f} mm, at most {off.max() / TAU:.1f} ({off.size} places)"
    )


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main(sys.argv[1], Path(sys.argv[2]))
