"""The table of people, and the summary of their results: the same as those of `overcoat replay --subjects`."""

import csv
import json
import re
import tomllib
from decimal import Decimal
from pathlib import Path
from typing import NamedTuple

LONGEST_NAME = 64


class BadInput(Exception):
    """One sentence: what is wrong, where, what to do."""


class Person(NamedTuple):
    line: int
    set: list  # pairs of key and value; paths are absolute
    files: list  # those of the values that are paths


def read_table(subjects, recipe):
    """The people by name, in the order of the table. Looks at no file but the table and the recipe."""
    steps = steps_of(recipe)
    lines = read(subjects).splitlines()
    # As in `overcoat replay`: `#` begins a comment, cells are trimmed.
    kept = [(at, line) for at, line in enumerate(lines, 1) if line.strip() and not line.startswith("#")]
    cells = [[cell.strip() for cell in row] for row in csv.reader(line for _, line in kept)]
    if len(cells) != len(kept):
        raise BadInput(f"{subjects}: a quoted cell goes over several lines; write each person in one line")
    rows = list(zip((at for at, _ in kept), cells))
    if len(rows) < 2:
        raise BadInput(f"{subjects}: there is no person in it; the first line names the columns, each other line is a person")
    head_line, head = rows[0]
    if len(head) == 1 and re.search("[;\t]", head[0]):
        raise BadInput(f"{subjects}, line {head_line}: the columns are not separated by commas; save the table with commas")
    for key in head[1:]:
        if key.split(".")[0] not in [*steps, "body_model"]:
            raise BadInput(f"{subjects}, line {head_line}: the recipe has no step for the column '{key}'; its steps are {', '.join(steps)}")
    people, seen = {}, {}
    for line, row in rows[1:]:
        where = f"{subjects}, line {line}"
        if len(row) != len(head):
            raise BadInput(f"{where}: the line has {len(row)} cells, the first line {len(head)}")
        name = row[0]
        if not re.fullmatch(r"\w[\w.-]*", name) or len(name.encode()) > LONGEST_NAME:
            raise BadInput(
                f"{where}: '{name}' cannot be the name of a person's folder; use letters, digits, '-', '_' and '.', at most {LONGEST_NAME} bytes"
            )
        if name.lower() in seen:
            raise BadInput(f"{where}: there is already a person '{name}' in line {seen[name.lower()]}; give each another name")
        seen[name.lower()] = line
        person = Person(line, [], [])
        for key, value in zip(head[1:], row[1:]):
            if value and (key in steps or key == "body_model" or key.endswith((".scan", ".mask"))):
                value = str(subjects.parent / value)
                person.files.append(value)
            if value:
                person.set.append((key, value))
        people[name] = person
    return people


def check_files(subjects, people):
    for name, person in people.items():
        for file in person.files:
            if not Path(file).exists():
                raise BadInput(
                    f"{subjects}, line {person.line}: there is no file '{file}' of '{name}'; correct the path, or put '#' before the line"
                )


def check_folder(into, subjects, recipe):
    """Refuses a folder that has the people of another batch."""
    note = note_of(into)
    if note.exists() and (other := json.loads(note.read_text())) != own(subjects, recipe):
        raise BadInput(
            f"the folder '{into}' has the people of {other['subjects']} with the recipe {other['recipe']}; give this batch another folder ('into')"
        )


def claim(into, subjects, recipe):
    note_of(into).parent.mkdir(parents=True, exist_ok=True)
    note_of(into).write_text(json.dumps(own(subjects, recipe)))


def note_of(into):
    return into / ".batch" / "batch.json"


def own(subjects, recipe):
    return {"subjects": str(subjects), "recipe": str(recipe)}


def write_summary(into, people):
    """Writes summary.csv; returns lines that list the failures."""
    results = {name: result_of(into / ".batch", name) for name in people}
    done = [result for result in results.values() if "error" not in result]
    steps = {step["step"] for result in done for step in result["steps"]}
    measures = {measure for result in done for measure in measures_of(result)}
    columns = [f"{step}.verdict" for step in sorted(steps)] + sorted(measures)
    partial = into / ".batch" / "summary.csv"
    with open(partial, "w", newline="", encoding="utf-8") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(["subject", "result", *columns])
        for name, result in results.items():
            if "error" in result:
                outcome, cells = f"failed: {result['error']['message']}", {}
            else:
                verdicts = {f"{step['step']}.verdict": step["verdict"] for step in result["steps"]}
                outcome = "good" if all(verdict == "good" for verdict in verdicts.values()) else "check"
                cells = verdicts | measures_of(result)
            out.writerow([name, outcome, *(cells.get(column, "") for column in columns)])
    partial.replace(into / "summary.csv")
    errors = {name: result["error"] for name, result in results.items() if "error" in result}
    failed = [f"{name}: {'; '.join(filter(None, (error['message'], error.get('hint'))))}" for name, error in errors.items()]
    count = f"{len(done)} of {len(people)} people dressed; all measures are in {into / 'summary.csv'}"
    return "\n".join([count, *failed])


def result_of(notes, name):
    """What `replay --json` printed for the person, or an error in the same form."""
    for file in (notes / f"{name}.json", notes / f"{name}.log"):
        try:
            result = json.loads(file.read_text(encoding="utf-8"), parse_float=Decimal)
        except (OSError, ValueError):
            continue
        if file.suffix == ".json" or "error" in result:
            return result
    return {"error": {"message": "the job ended before its result was complete; run the same command again"}}


def measures_of(result):
    """The measures by step and stage, written as `replay --subjects` writes them: shortest digits, no exponent."""
    return {
        f"{stage['step']}.{stage['stage']}.{measure}": "NaN" if value is None else f"{value:f}".removesuffix(".0")
        for stage in result["stages"]
        for measure, value in stage["measures"].items()
    }


def steps_of(recipe):
    try:
        return [step["name"] for step in tomllib.loads(read(recipe))["step"]]
    except (tomllib.TOMLDecodeError, KeyError, TypeError):
        raise BadInput(f"{recipe} is not a recipe with steps; name the recipe.toml of a session, or the session's folder")


def read(path):
    try:
        return path.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        raise BadInput(f"there is no file '{path}'; correct the path in the config")
    except UnicodeDecodeError:
        raise BadInput(f"{path} is not UTF-8 text; save it as UTF-8")
