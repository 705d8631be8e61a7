"""Markdown tables from the figures of quality.py."""
import itertools
import sys

MARK = "<!-- tables of tests/bench/quality.py -->"
NOISE = "noise of the ground truth"
TRUTH = {"motion": "mb", "lens": "dof", "both": "both"}  # of each table


def _cell(figure):
    psnr = figure.get("psnr_without_noise", figure["psnr"])
    return [psnr, figure["hdr_flip"], figure["ssim"]]


def _mean(values):
    values = list(values)
    return sum(values) / len(values)


def _text(cell):
    return "{:.2f} / {:.3f} / {:.3f}".format(*cell).replace("/ 0.", "/ .")


def _print_row(*cells):
    print("| " + " | ".join(cells) + " |")


def _print_head(*cells):
    _print_row(*cells)
    print("|---" * len(cells) + "|")


def _print_errors(title, scenes, rows, times):
    _print_head(title, *scenes, "mean", *["time"] * times)
    first = next((total for row in rows.values() if (total := sum(one["ms"] for one in row))), None)
    for label, row in rows.items():
        cells, total = [_cell(figure) for figure in row], sum(figure["ms"] for figure in row)
        mean = [_mean(values) for values in zip(*cells)]
        _print_row(label, *map(_text, [*cells, mean]), *[f"{total / first:.1f}" if total else ""] * times)
    print()


def _print_rims(scenes, rows):
    """PSNR near the rims; the mean is over scenes with rims."""
    rows = {label: row for label, row in rows.items() if "rim_psnr" in row[0]}
    if not any(figure["rim_pixels"] for row in rows.values() for figure in row):
        return
    _print_head("rims of bokeh, PSNR", *scenes, "mean")
    _print_row("pixels", *(str(figure["rim_pixels"] or "-") for figure in next(iter(rows.values()))), "")
    for label, row in rows.items():
        cells = [figure["rim_psnr"] for figure in row]
        _print_row(label, *("-" if cell is None else f"{cell:.2f}" for cell in cells),
                   f"{_mean(cell for cell in cells if cell is not None):.2f}")
    print()


def print_tables(figures, times):
    """For each set, frame and table. A row that lacks scenes is left out, with a message."""
    def group(figure):
        return figure["set"], figure["frame"], list(TRUTH).index(figure["table"])

    several = len({figure["set"] for figure in figures}) > 1
    last = None
    for key, own in itertools.groupby(sorted(figures, key=group), group):
        own = list(own)
        if several and key[0] != last:
            print(f"{key[0]}\n")
        last = key[0]
        scenes = sorted({figure["scene"] for figure in own})
        rows = {}
        for label in dict.fromkeys(figure["row"] for figure in own):
            row = {figure["scene"]: figure for figure in own if figure["row"] == label}
            lacking = [scene for scene in scenes if scene not in row]
            if lacking:
                print(f"no row \"{label}\": not measured for {', '.join(lacking)}", file=sys.stderr)
                continue
            rows[label] = [row[scene] for scene in scenes]
        if rows:
            _print_errors(f"frame {key[1]}, `{TRUTH[own[0]['table']]}`", scenes, rows, times)
            _print_rims(scenes, rows)


def write_between_marks(path, text):
    """Replaces what is between two lines MARK by text."""
    parts = path.read_text("utf8").split(MARK)
    if len(parts) != 3:
        sys.exit(f"{path}: needs two lines {MARK}, has {len(parts) - 1}")
    path.write_text(f"{parts[0]}{MARK}\n\n{text.strip()}\n\n{MARK}{parts[2]}", "utf8")
