#!/usr/bin/env python3
"""Checks caribou's hits against Embree, an independent ray tracer.

    caribou bench SCENE --rays diffuse --dump-rays out/rays.bin --json out/bench.json
    python3 -m venv out/venv && out/venv/bin/pip install embreex numpy
    out/venv/bin/python tools/compare_embree.py out/rays.bin --json out/bench.json

Prints how many rays agree and how the others differ, and the speeds side by side. Exit code 0 if no more
than --allow of the rays disagree, 1 if more do, 2 if the input is unusable.

A ray agrees if both miss, or both hit at the same distance within --tolerance; of rays that ask for any hit
(kind ao) only whether they hit is compared. It is a tie if it agrees on
the distance but not on the primitive: two triangles at the same place, mostly a shared edge. Where the two
disagree but one of the hits lies on the edge of its triangle or at an end of the ray, rounding decides, and
that is counted apart from real disagreements.
"""

import argparse
import json
import statistics
import struct
import sys
import time

try:
    import numpy as np
    from embreex import rtcore_scene
    from embreex.mesh_construction import TriangleMesh
except ImportError as error:
    print(f"compare_embree: {error}; install with\n"
          "  python3 -m venv out/venv && out/venv/bin/pip install embreex numpy\n"
          "and run with out/venv/bin/python", file=sys.stderr)
    sys.exit(2)

HEADER = 20
MISS = 0xFFFFFFFF
RAY = np.dtype([("origin", "<f4", 3), ("t_min", "<f4"), ("direction", "<f4", 3), ("t_max", "<f4")])
HIT = np.dtype([("t", "<f4"), ("prim", "<u4"), ("u", "<f4"), ("v", "<f4")])

# A barycentric weight below this is an edge: what rounding does to the weights of a triangle that is some
# thousand times as far from the origin of coordinates as it is large.
EDGE = 1e-4

# Distances cannot be better than the coordinates they are computed from: a few roundings of the largest one.
COORDINATE_ERROR = 4 * 2.0**-24


def read_dump(path):
    """Triangles (n, 3, 3), rays, hits, and whether any hit was asked for, of a file by src/report/ray_dump.rs."""
    with open(path, "rb") as file:
        data = file.read()
    if len(data) < HEADER or data[:4] != b"CRBR":
        raise ValueError(f"{path}: not a ray dump (it does not begin with CRBR)")
    version, ray_count, triangle_count, any_hit = struct.unpack_from("<4I", data, 4)
    if version != 2:
        raise ValueError(f"{path}: version {version}; this tool reads version 2")
    expected = HEADER + 36 * triangle_count + (RAY.itemsize + HIT.itemsize) * ray_count
    if len(data) != expected:
        raise ValueError(f"{path}: {len(data)} bytes instead of {expected}; write it again")
    triangles = np.frombuffer(data, "<f4", 9 * triangle_count, HEADER).reshape(-1, 3, 3)
    rays = np.frombuffer(data, RAY, ray_count, HEADER + 36 * triangle_count)
    hits = np.frombuffer(data, HIT, ray_count, HEADER + 36 * triangle_count + RAY.itemsize * ray_count)
    return triangles, rays, hits, any_hit != 0


def trace(triangles, rays, runs):
    """Embree's nearest hits in robust mode, and the seconds of each run after a first one to warm up."""
    # embreex has no t_min: the origin is moved there, and the distance moved back.
    t_min = rays["t_min"]
    origins = np.ascontiguousarray(rays["origin"] + t_min[:, None] * rays["direction"], np.float32)
    directions = np.ascontiguousarray(rays["direction"], np.float32)
    # embreex takes 1e37 for "no limit".
    lengths = np.minimum(rays["t_max"] - t_min, np.float32(1e37)).astype(np.float32)
    alive = lengths >= 0
    found = np.zeros(len(rays), HIT)
    found["prim"] = MISS
    if len(triangles) == 0 or not alive.any():
        return found, alive, []
    scene = rtcore_scene.EmbreeScene(robust=True)
    # The mesh is kept alive by this name; the scene holds no reference of its own.
    mesh = TriangleMesh(scene, np.ascontiguousarray(triangles, np.float32))
    seconds = []
    for _ in range(runs + 1):
        start = time.perf_counter()
        result = scene.run(origins[alive], directions[alive], dists=lengths[alive].copy(), output=True)
        seconds.append(time.perf_counter() - start)
    del mesh
    found["prim"][alive] = result["primID"].astype(np.int64).astype(np.uint32)
    found["t"][alive] = result["tfar"] + t_min[alive]
    found["u"][alive] = result["u"]
    found["v"][alive] = result["v"]
    return found, alive, seconds[1:]


def on_edge(hits):
    """Whether each hit lies on an edge of its triangle; False for a miss."""
    weights = np.minimum(np.minimum(hits["u"], hits["v"]), 1 - hits["u"] - hits["v"])
    return (hits["prim"] != MISS) & (weights < EDGE)


def compare(triangles, rays, ours, theirs, any_hit, tolerance):
    """Counts by kind, the worst relative error among same-primitive hits, and the real disagreements."""
    hit, hit_there = ours["prim"] != MISS, theirs["prim"] != MISS
    both = hit & hit_there
    if any_hit:  # only whether there is one was asked
        ours = np.where(both, theirs, ours)
        for field in ("t", "u", "v"):
            ours[field][hit & ~hit_there] = np.nan
    scale = max(np.abs(triangles).max(initial=0), np.abs(rays["origin"]).max(initial=0))
    t, t_there = ours["t"].astype(np.float64), theirs["t"].astype(np.float64)
    error = np.where(both, np.abs(t - t_there), 0)
    same_t = both & (error <= tolerance * np.abs(t_there) + COORDINATE_ERROR * scale)
    same_prim = both & (ours["prim"] == theirs["prim"])
    agree = same_t | ~(hit | hit_there)

    def at_end(hits):
        near = tolerance * np.abs(hits["t"]) + COORDINATE_ERROR * scale
        with np.errstate(invalid="ignore"):  # the infinite ends of misses
            ends = (np.abs(hits["t"] - rays["t_min"]) <= near) | (np.abs(hits["t"] - rays["t_max"]) <= near)
        return (hits["prim"] != MISS) & ends

    rounding = ~agree & (on_edge(ours) | on_edge(theirs) | at_end(ours) | at_end(theirs))
    real = ~agree & ~rounding
    relative = error[same_prim & same_t] / np.maximum(np.abs(t_there[same_prim & same_t]), 1e-30)
    counts = {
        "rays": len(rays),
        "agree": int(agree.sum()),
        "  of them ties (same t, other primitive)": int((same_t & ~same_prim).sum()),
        "differ at an edge or an end of the ray": int(rounding.sum()),
        "disagree": int(real.sum()),
        "  hit here, miss there": int((real & hit & ~hit_there).sum()),
        "  miss here, hit there": int((real & ~hit & hit_there).sum()),
        "  other distance": int((real & both).sum()),
    }
    return counts, float(relative.max(initial=0)), np.flatnonzero(real)


def print_speeds(ray_count, seconds, bench):
    """Embree's speed and, from a caribou-bench/1 file, all results with as many rays."""
    print("\nMrays/s (median)")
    if seconds:
        print(f"  {'Embree, 1 thread, single rays':40} {ray_count / statistics.median(seconds) / 1e6:9.2f}")
    for result in bench.get("results", []):
        if result["ray_count"] == ray_count:
            name = f"caribou {result['strategy']}, {result['rays']}"
            print(f"  {name:40} {result['mrays_per_s']['median']:9.2f}")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("dump", help="file written by caribou bench --dump-rays")
    parser.add_argument("--json", help="file written by caribou bench --json, for the speeds")
    parser.add_argument("--tolerance", type=float, default=1e-4, help="relative, on t (default 1e-4)")
    parser.add_argument("--allow", type=float, default=0.0, help="share of rays that may disagree (default 0)")
    parser.add_argument("--runs", type=int, default=3, help="timed runs of Embree (default 3)")
    arguments = parser.parse_args()
    try:
        triangles, rays, ours, any_hit = read_dump(arguments.dump)
        bench = {}
        if arguments.json:
            with open(arguments.json, encoding="utf-8") as file:
                bench = json.load(file)
    except (OSError, ValueError) as error:
        print(f"compare_embree: {error}", file=sys.stderr)
        return 2

    theirs, alive, seconds = trace(triangles, rays, max(arguments.runs, 1))
    counts, worst, real = compare(triangles, rays, ours, theirs, any_hit, arguments.tolerance)
    for name, count in counts.items():
        print(f"{name:42} {count:>12,}")
    print(f"{'worst relative error of t':42} {worst:>12.2e}")
    for index in real[:5]:
        print(f"  ray {index}: here {ours[index]}, Embree {theirs[index]}, {rays[index]}")
    print_speeds(int(alive.sum()), seconds, bench)
    return 1 if counts["disagree"] > arguments.allow * len(rays) else 0


if __name__ == "__main__":
    sys.exit(main())
