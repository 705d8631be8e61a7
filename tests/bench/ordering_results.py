"""What has been measured: docs/results/ordering.json, one line for each scene, input and chain."""
import json

KEYS = ["errors", "times", "claims", "sizes"]
METRIC_KEYS = ["psnr", "hdr_flip", "ssim", "tde"]
CLAIM_KEYS = ["edges_in_blurred", "sharpness_in_focus", "flicker", "grid"]


def rounded(value, digits=6):
    return None if value is None else float(f"{value:.{digits}g}")


class Results:
    """Rows of errors {scene, source, chain, passes, version, frames: {number: {metric: value}}},
    times {scene, frames, ratios}, claims {scene, chains, frames, values} and sizes {scene, frame,
    streak_px, circle_px}; saved after each."""

    def __init__(self, path):
        self.path = path
        stored = json.loads(path.read_text()) if path.exists() else {}
        self.errors, self.times, self.claims, self.sizes = (stored.get(key, []) for key in KEYS)

    def row(self, scene, source, chain, passes, version):
        """The row of this measurement; a row of another text or version is replaced."""
        key = {"scene": scene, "source": source, "chain": chain}
        for row in self.errors:
            if all(row[name] == value for name, value in key.items()):
                if (row["passes"], row["version"]) != (passes, version):
                    row.update(passes=passes, version=version, frames={})
                return row
        self.errors.append({**key, "passes": passes, "version": version, "frames": {}})
        return self.errors[-1]

    def add(self, row, found):
        row["frames"].update({str(frame): {key: rounded(values[key]) for key in METRIC_KEYS}
                              for frame, values in found.items()})
        row["frames"] = dict(sorted(row["frames"].items(), key=lambda item: int(item[0])))
        self.save()

    def add_times(self, scene, frames, ratios):
        self.times = [one for one in self.times if one["scene"] != scene]
        self.times.append({"scene": scene, "frames": frames,
                           "ratios": {name: rounded(ratio, 3) for name, ratio in ratios.items()}})
        self.save()

    def has_claims(self, scene, pair):
        return any(one["scene"] == scene and one["chains"] == list(pair) for one in self.claims)

    def add_claims(self, scene, pair, report):
        """From report.json of `ab`: the means of both chains."""
        self.claims.append({
            "scene": scene, "chains": list(pair), "frames": report["frames"],
            "values": {key: [rounded(variant["metrics"][key]["mean"])
                             for variant in report["variants"]] for key in CLAIM_KEYS}})
        self.save()

    def add_sizes(self, scene, frame, streak, circle):
        self.sizes = [one for one in self.sizes if one["scene"] != scene]
        self.sizes.append({"scene": scene, "frame": frame, "streak_px": rounded(streak, 3),
                           "circle_px": rounded(circle, 3)})
        self.save()

    def frames(self, scene, source, chain):
        """{frame: {metric: value}}; empty where nothing was measured."""
        for row in self.errors:
            if (row["scene"], row["source"], row["chain"]) == (scene, source, chain):
                return {int(frame): values for frame, values in row["frames"].items()}
        return {}

    def scenes(self):
        return sorted({row["scene"] for row in self.errors},
                      key=lambda name: (name.startswith("generated"), name))

    def save(self):
        parts = []
        for key in KEYS:
            rows = ",\n".join(json.dumps(row) for row in getattr(self, key) if row.get("frames", 1))
            parts.append(f'"{key}": [\n{rows}\n]')
        text = "{" + ",\n".join(parts) + "}\n"
        temporary = self.path.with_suffix(".json.tmp")
        temporary.write_text(text)
        temporary.replace(self.path)
