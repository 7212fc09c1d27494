"""Converts a level file of CREATE to a task file, with the level's random shifts:
`create_level.py level_push.json > push.json`. Expressions in the file are evaluated, as in CREATE: convert only files
that you trust."""

import json
import math
import sys
from types import SimpleNamespace

# Half widths of random shifts, the height of a ball's centre above the floor it lies on, and what CREATE imports.
NAMES = {
    "DEF_NOISE": 0.05,
    "MID_NOISE": 0.1,
    "HIGH_NOISE": 0.2,
    "LARGE_NOISE": 0.5,
    "OFFSET": 0.11,
    "GOAL_RADIUS": 4.0,
    "LINE_THICKNESS": 2.0,
    "np": SimpleNamespace(pi=math.pi),
    "uniform": lambda low, high: SimpleNamespace(low=low, high=high),
    "random": SimpleNamespace(choice=lambda values: {"one_of": values}),
}

# Objects by name: type, size in units, and what else differs from the defaults of the type.
OBJECTS = {
    "floor": ("floor", 16, {}),
    "long_floor": ("floor", 24, {}),
    "medium_floor": ("floor", 16, {}),
    "short_floor": ("floor", 8, {}),
    "very_short_floor": ("floor", 4, {}),
    "wall": ("wall", 16, {}),
    "wall_elastic": ("wall", 16, {"elasticity": 0.8}),
    "ramp": ("ramp", 16, {}),
    "trampoline": ("trampoline", 16, {}),
    "bucket": ("bucket", 10, {"angle": math.pi / 4}),
    "funnel": ("funnel", 10, {"angle": math.pi / 4}),
    "fixed_triangle": ("triangle", 10, {}),
    "fixed_square": ("square", 10, {}),
    "fixed_pentagon": ("pentagon", 10, {}),
    "fixed_hexagon": ("hexagon", 10, {}),
    "fixed_box": ("box", 10, {}),
    "fixed_circle": ("circle", 5, {}),
    "hinge_ramp": ("hinge", 24, {}),
    "see_saw": ("see_saw", 24, {}),
    "cannon": ("cannon", 10, {}),
    "fan": ("fan", 10, {}),
    "belt": ("belt", 20, {}),
    "right_belt": ("belt", 20, {"vel": -4.0}),
    "ladder": ("ladder", 20, {}),
    "down_ladder": ("ladder", 20, {"vel": -4.0}),
    "fast_ladder": ("ladder", 15, {}),
}
# Values that need not be given, as the type has them.
USUAL = {
    "bucket": {"angle": 0.0},
    "funnel": {"angle": 0.0},
    "hinge": {"roll_friction": 1.0},
    "see_saw": {"roll_friction": 1.0},
    "belt": {"vel": 5.0},
    "ladder": {"vel": 4.0},
}
BALLS = {"marker_ball": 4.0, "target_ball": 4.0, "basket_ball": 3.5, "ball": 4.0}
PROPERTIES = ("angle", "elasticity", "force", "vel", "max_angle", "on_left", "ball_mass")


def value(entry):
    """A value as JSON or as an expression in a string."""
    if isinstance(entry, list):
        return [value(item) for item in entry]
    return eval(entry, {"__builtins__": {}}, NAMES) if isinstance(entry, str) else entry


def tool(entry):
    kind, size, other = OBJECTS[entry["name"]]
    given = {name: value(entry[name]) for name in entry if name not in ("name", "id", "color", "pos")}
    made = {"type": kind, "position": value(entry["pos"]), "size": float(size), **other}
    for name in ("size", "length", "radius"):
        made["size"] = float(given.pop(name, made["size"]))
    # CREATE divides whole numbers: a thickness of 1 gives no rounding.
    if given.pop("thickness", 2.0) // 2 == 0:
        made["radius"] = 0.0
    friction = given.pop("friction", 1.0)
    if kind in ("hinge", "see_saw"):
        made["roll_friction"] = friction
    elif friction != 1.0:
        made["friction"] = friction
    if given.pop("sensor", False):
        sys.exit(f"{entry['name']}: sensors are not supported")
    made.update({name: given.pop(name) for name in PROPERTIES if name in given})
    if given:
        sys.exit(f"{entry['name']}: {', '.join(given)} cannot be converted")
    return {name: value for name, value in made.items() if USUAL.get(kind, {}).get(name) != value}


def ball(entry):
    made = {"position": value(entry["pos"]), "radius": float(value(entry.get("radius", BALLS[entry["name"]])))}
    made["mass"] = float(value(entry.get("mass", 10)))
    return {**made, **{name: value(entry[name]) for name in ("elasticity", "friction") if name in entry}}


def box(entry):
    names = ("size", "mass", "elasticity", "friction")
    return {"position": value(entry["pos"]), **{name: value(entry[name]) for name in names if name in entry}}


def shift(by):
    if isinstance(by, dict):
        return by
    ends = [(axis.low, axis.high) if isinstance(axis, SimpleNamespace) else (axis, axis) for axis in by]
    return {"uniform": dict(zip("xy", ends, strict=True))}


def task(level):
    made = {"tools": [], "balls": [], "boxes": []}
    named = []
    is_marker_level = level.get("lvl_type") == "marker"
    for entry in level["env"]:
        if is_marker_level and not named:
            marker, part = ball(entry), "marker"
        elif entry["name"] in BALLS:
            made["balls"].append(ball(entry))
            part = {"ball": len(made["balls"]) - 1}
        elif entry["name"] == "box":
            made["boxes"].append(box(entry))
            part = {"box": len(made["boxes"]) - 1}
        else:
            made["tools"].append(tool(entry))
            part = {"tool": len(made["tools"]) - 1}
        named.append((f"{entry['name']}:{entry['id']}" if "id" in entry else entry["name"], part))
    order = [part for _, part in named]
    of_marker, of_target = (
        [{"position": value(at), "radius": 3.0} for at in level.get(f"{ball}_sec_goals", [])] for ball in ("marker", "target")
    )
    order += [{"marker_subgoal": index} for index in range(len(of_marker))]
    order += [{"subgoal": index} for index in range(len(of_target))]
    if value(level.get("place_walls", False)):
        for kind, at in (("wall", [1, 0]), ("wall", [-1, 0]), ("floor", [0, 1])):
            order.append({"tool": len(made["tools"])})
            made["tools"].append({"type": kind, "position": at, "size": 90.0})
    order += ["target", "goal"]
    if is_marker_level:
        must_hit = value(level.get("marker_must_hit", False))
        made["marker"] = {"ball": marker, "must_hit": must_hit, "subgoals": of_marker}
    named += [("target", "target"), ("goal", "goal")]
    shifts = []
    for names, by in level.get("rnd", {}).items():
        parts = [part for name in names.split(",") for own, part in named if own == name.strip()]
        # CREATE switches a shift off by a name that no object has.
        if parts:
            shifts.append({"parts": parts, "by": shift(value(by))})
    shape = "ball" if value(level.get("moving_goal", False)) else "star"
    shape = "basket" if value(level.get("goal_is_basket", False)) else shape
    radius = 3.5 if value(level.get("ball_is_basket", False)) else float(value(level.get("target_ball_radius", 4)))
    return {
        "version": 1,
        "name": f"{level['name']}-random",
        "description": f"CREATE's level {level['name']}.",
        "ball": {"position": value(level["target"]), "radius": radius},
        **made,
        "placeable": {"type": "box"},
        "subgoals": of_target,
        "goal": {"position": value(level["goal"]), "radius": 5.0 if shape == "basket" else 4.0, "shape": shape},
        "rules": {
            # In CREATE the action after the last allowed one ends the episode.
            "max_actions": level.get("max_num_steps", 30) + 1,
            "rewards": {
                "subgoal": value(level.get("sec_goal_reward", 2.0)),
                "target_moved": value(level.get("target_reward", 1.0)),
                "cost_per_tool": 0.1,
            },
            "overlap_threshold": value(level.get("overlap_thresh", 0.3)),
            "subgoal_check": "action_end",
            "in_order": False,
            "goal_ends_episode": False,
            "capture_is_standstill": False,
        },
        "order": order,
        "shifts": shifts,
    }


if __name__ == "__main__":
    if len(sys.argv) != 2 or sys.argv[1].startswith("-"):
        sys.exit("usage: create_level.py LEVEL.json > TASK.json")
    with open(sys.argv[1], encoding="utf-8-sig") as file:
        print(json.dumps(task(json.load(file)), indent=2))
