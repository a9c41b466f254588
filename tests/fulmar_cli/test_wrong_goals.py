"""Wrong goals, starts, velocities and heights: one line that names what is wrong and what is allowed; none passes."""

from __future__ import annotations

import pytest

from tests.fulmar_cli.command_line import complaint

PLATFORM, CAR, BOAT = ("run", "floating_platform"), ("run", "leatherback"), ("run", "kingfisher")
CRAFT, BALL = ("run", "spacecraft_16"), ("run", "int_ball2")
SATELLITE, NAVION, SHIP = ("run", "cubesat_wheels"), ("run", "navion"), ("run", "airship_v7")
PLANE, SPACE = (
    "2 (x,y) or 3 (x,y,deg) are needed [m, deg]",
    "3 (x,y,z) or 6 (x,y,z,roll,pitch,yaw) are needed",
)
TURNS = "'cubesat_wheels' goes to no place: 3 (roll,pitch,yaw) are needed [deg]"
SIX = "--goal x,y,z,roll,pitch,yaw [m, deg]. For a place x,y,z with any attitude add --task go_to_position_3d"
NOWHERE = (
    "would have no effect, 'cubesat_wheels' goes to no place. Give an attitude alone: roll,pitch,yaw [deg]"
)
NO_STOP = "it cannot stop at a place. Say --height H [m] or --velocity V [m/s]"
NONE = "is no finite number"
WRONG = [
    # Of the wrong length.
    ((*PLATFORM, "--goal", "1"), f"has 1 number; 'floating_platform' moves in two dimensions: {PLANE}"),
    (
        (*PLATFORM, "--goal", "1,2,3,4"),
        f"has 4 numbers; 'floating_platform' moves in two dimensions: {PLANE}",
    ),
    (
        (*PLATFORM, "--goal", "1,0,-0.5,0,30,90"),
        f"has 6 numbers; 'floating_platform' moves in two dimensions: {PLANE}",
    ),
    ((*CAR, "--goal", "1,2,3,4,5"), f"has 5 numbers; 'leatherback' moves in two dimensions: {PLANE}"),
    (
        (*PLATFORM, "--start", "1,2,3,4"),
        "--start = '1,2,3,4' has 4 numbers; 'floating_platform' moves in two dimensions",
    ),
    ((*CRAFT, "--goal", "1,2"), f"has 2 numbers; 'spacecraft_16' moves in space: {SPACE}"),
    ((*CRAFT, "--goal", "1,2,3,4"), f"has 4 numbers; 'spacecraft_16' moves in space: {SPACE}"),
    ((*CRAFT, "--goal", "1,2,3,4,5,6,7"), f"has 7 numbers; 'spacecraft_16' moves in space: {SPACE}"),
    ((*CRAFT, "--start", "1,2"), f"--start = '1,2' has 2 numbers; 'spacecraft_16' moves in space: {SPACE}"),
    ((*SATELLITE, "--goal", "90"), f"has 1 number; {TURNS}"),
    ((*SATELLITE, "--goal", "0,90"), f"has 2 numbers; {TURNS}"),
    ((*SATELLITE, "--goal", "0,0,0,1"), f"has 4 numbers; {TURNS}"),
    ((*SATELLITE, "--start", "0,90"), "--start = '0,90' has 2 numbers; 'cubesat_wheels' goes to no place"),
    ((*NAVION, "--goal", "1,2"), "has 2 numbers; 'navion' goes to no place: 3 (roll,pitch,yaw) are needed"),
    # Of another kind of robot.
    ((*CRAFT, "--goal", "1,0,90"), SIX),
    ((*BALL, "--goal", "1,0,90"), SIX),
    (
        (*CRAFT, "--goal", "1,0,90", "--task", "go_to_pose_3d"),
        "needs an attitude: --goal x,y,z,roll,pitch,yaw",
    ),
    ((*SATELLITE, "--goal", "5,0,0,0,0,90"), f"x = 5 m {NOWHERE}"),
    ((*SATELLITE, "--goal", "0,-2,0.5,0,0,90"), f"y = -2 m, z = 0.5 m {NOWHERE}"),
    ((*SATELLITE, "--goal", "5,0,0,0,0,90", "--task", "point"), f"x = 5 m {NOWHERE}"),
    ((*NAVION, "--goal", "100,0,50"), NO_STOP),
    (
        (*SHIP, "--goal", "100,0,50,0,0,0"),
        "x = 100 m, z = 50 m would have no effect, 'airship_v7' goes to no place",
    ),
    ((*NAVION, "--goal", "0,0,0", "--task", "fly_hold", "--height", "20"), "do not fit into one --goal"),
    ((*NAVION, "--goal", "0,0,0", "--task", "fly_airspeed"), "or --velocity gives one"),
    ((*PLATFORM, "--goal", "1,2", "--task", "go_to_pose"), "needs a heading: --goal x,y,deg"),
    ((*PLATFORM, "--goal", "1,2,0", "--task", "track_velocities"), "or --velocity gives one"),
    ((*CAR, "--goal", "1,2,90"), "Say --task go_to_position or --goal x,y"),
    # No numbers, or with units.
    ((*PLATFORM, "--goal", "nan,0,0"), f"--goal = 'nan,0,0': 'nan' {NONE}"),
    ((*PLATFORM, "--goal", "inf,0"), f"'inf' {NONE}"),
    ((*PLATFORM, "--goal", "1m,0"), f"'1m' {NONE}. Give x,y or x,y,deg [m, deg], with commas and no units"),
    ((*PLATFORM, "--goal", "1,0,90deg"), f"'90deg' {NONE}"),
    ((*PLATFORM, "--goal", "1,0,pi/2"), f"'pi/2' {NONE}"),
    ((*PLATFORM, "--goal", "1;0"), f"'1;0' {NONE}"),
    ((*PLATFORM, "--goal", "1,,0"), f"'' {NONE}"),
    ((*PLATFORM, "--goal", ""), f"'' {NONE}"),
    ((*PLATFORM, "--start", "0,0,nan"), f"--start = '0,0,nan': 'nan' {NONE}"),
    ((*CRAFT, "--goal", "1,0,0,0,0,x"), f"'x' {NONE}. Give x,y,z or x,y,z,roll,pitch,yaw [m, deg]"),
    ((*SATELLITE, "--goal", "0,0,east"), f"'east' {NONE}. Give roll,pitch,yaw"),
    ((*PLATFORM, "--velocity", "fast,0,0"), f"--velocity = 'fast,0,0': 'fast' {NONE}"),
    # Beyond what can be reached.
    (
        (*PLATFORM, "--goal", "100,0,0"),
        "the goal lies 100 m from the origin, and 'floating_platform' goes at most 8 m",
    ),
    ((*PLATFORM, "--goal", "100,50"), "the goal lies 111.803 m from the origin"),
    (
        (*PLATFORM, "--goal", "2000,0,0"),
        "x = 2000 m, y = 0 m lies 2,000 m from the origin, farther than 1,000 m",
    ),
    (
        (*PLATFORM, "--goal", "100,0,0", "--area=-8,8,-8,8"),
        "lies outside the area of x -8 to 8 m, y -8 to 8 m",
    ),
    (
        (*PLATFORM, "--goal", "0,0,0", "--start", "9,0,0"),
        "9.0 m apart, the geofence of 'floating_platform' is 8 m",
    ),
    ((*BOAT, "--goal", "150,0"), "the goal lies 150 m from the origin"),
    ((*CRAFT, "--goal", "0,0,150,0,0,0"), "the goal lies 150 m from the origin"),
    # Velocities.
    (
        (*PLATFORM, "--velocity", "0.3"),
        "has 1 number; 'floating_platform' takes 3: ahead,left,turning [m/s, deg/s]",
    ),
    (
        (*CRAFT, "--velocity", "0.1,0,0"),
        "has 3 numbers; 'spacecraft_16' takes 6: ahead,left,up,roll,pitch,yaw",
    ),
    ((*NAVION, "--velocity", "50,0,0"), "has 3 numbers; 'navion' takes 1: ahead [m/s, deg/s]"),
    ((*PLATFORM, "--velocity", "30,0,0"), "ask for 30 m/s; 'floating_platform' goes at most 1.4 m/s"),
    ((*PLATFORM, "--velocity", "0,0,500"), "ask for 500 deg/s; 'floating_platform' turns with at most"),
    ((*CAR, "--velocity", "0.3,0.2,0"), "ask for 0.2 m/s sideways; 'leatherback' cannot go sideways"),
    ((*CAR, "--velocity", "0,0,10"), "'leatherback' turns in no circle of less than"),
    ((*NAVION, "--velocity", "5"), "'navion' has no trim at 5 m/s"),
    (
        (*SATELLITE, "--velocity", "0.1,0,0"),
        "--velocity is not for satellites that only turn such as 'cubesat_wheels'",
    ),
    ((*PLATFORM, "--velocity", "0.1,0,0", "--task", "go_to_pose"), "task 'go_to_pose' has no velocities"),
    # Heights.
    ((*PLATFORM, "--height", "2"), "--height is not for robots that are pushed over a floor or water"),
    ((*CRAFT, "--height", "2"), "--height is not for bodies that are pushed in space"),
    ((*NAVION, "--height", "1"), "starts at 0.75 m, where the hull of 'navion' touches the ground"),
    ((*NAVION, "--height", "-5"), "'--height'"),
    ((*NAVION, "--height", "20000"), "--height = 20000 m is too high: at most 10,000 m"),
    ((*NAVION, "--height", "nan"), "'--height'"),
    ((*SHIP, "--height", "nan"), "'--height'"),
    ((*SHIP, "--height", "5", "--task", "fly_a"), "task 'fly_a' has no height to choose"),
    # Two at once.
    (
        (*PLATFORM, "--goal", "0,0", "--goals", "circle"),
        "--goals brings its own goals; it takes no --goal",
    ),
    ((*PLATFORM, "--goal", "0,0", "--velocity", "0.1,0,0"), "--goal and --velocity are two goals"),
]


@pytest.mark.parametrize(("words", "reported"), WRONG, ids=[" ".join(words) for words, _ in WRONG])
def test_a_wrong_goal_is_named_with_what_is_allowed(fulmar, words, reported):
    assert reported in complaint(fulmar(*words, "--record", "never"))
