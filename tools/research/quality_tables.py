"""Markdown tables from the figures of quality.py."""
import itertools
import sys

MARK = "<!-- tables of tools/research/quality.py -->"
NOISE = "noise of the ground truth"
TRUTH = {"motion": "mb", "lens": "dof", "both": "both"}  # ground truth for each table


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
    first = next((total for row in rows.values() if (total := _time(row))), None)
    for label, row in rows.items():
        cells = [figure and _cell(figure) for figure in row]
        mean = None if None in cells else [_mean(values) for values in zip(*cells)]
        time = f"{_time(row) / first:.1f}" if _time(row) else ""
        _print_row(label, *("-" if cell is None else _text(cell) for cell in [*cells, mean]), *[time] * times)
    print()


def _time(row):
    """ms on all scenes; 0 if unknown on one."""
    return sum(figure["ms"] for figure in row) if all(row) else 0


def _print_rims(scenes, rows):
    """PSNR near the rims; the mean is over scenes with rims."""
    rows = {label: row for label, row in rows.items() if any("rim_psnr" in one for one in row if one)}
    pixels = [max((row[i]["rim_pixels"] for row in rows.values() if row[i]), default=0)
              for i in range(len(scenes))]
    if not any(pixels):
        return
    _print_head("rims of bokeh, PSNR", *scenes, "mean")
    _print_row("pixels", *(str(number or "-") for number in pixels), "")
    for label, row in rows.items():
        cells = [figure and figure["rim_psnr"] for figure in row]
        whole = all(row) and any(cells)
        _print_row(label, *("-" if cell is None else f"{cell:.2f}" for cell in cells),
                   f"{_mean(cell for cell in cells if cell is not None):.2f}" if whole else "-")
    print()


def print_tables(figures, times):
    """For each set, frame and table. A row that lacks scenes has no mean."""
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
            rows[label] = [row.get(scene) for scene in scenes]
        _print_errors(f"frame {key[1]}, `{TRUTH[own[0]['table']]}`", scenes, rows, times)
        _print_rims(scenes, rows)


EXACT = {"error": 4, "error_still": 4, "temporal_error": 3, "temporal_error_still": 3}  # digits


def print_exact(shots):
    """Means over the frames of shots with exact ground truth (exact_shots --json), by chain."""
    for metric, digits in EXACT.items():
        chains = list(next(iter(shots.values())))
        rows = {shot: [of_chains[chain][metric]["mean"] for chain in chains] for shot, of_chains in shots.items()}
        rows = {shot: row for shot, row in rows.items() if None not in row}
        if not rows:
            continue
        rows["mean"] = [_mean(column) for column in zip(*rows.values())]
        _print_head(f"exact shots, {metric}", *chains)
        for shot, row in rows.items():
            _print_row(shot, *(f"{value:.{digits}f}".removeprefix("0") for value in row))
        print()


def write_between_marks(path, text, mark=MARK):
    """Replaces what is between two lines of the mark by text."""
    parts = path.read_text("utf8").split(mark)
    if len(parts) != 3:
        sys.exit(f"{path}: needs two lines {mark}, has {len(parts) - 1}")
    path.write_text(f"{parts[0]}{mark}\n\n{text.strip()}\n\n{mark}{parts[2]}", "utf8")
