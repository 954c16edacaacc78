//! What people's scenes say beyond polygons and one rectangle: polylines, a drivable area, what is low, contours and
//! margins for each side.

use std::f64::consts::FRAC_PI_2;

use n3p::curves::Segment;
use n3p::geometry::{Aabb, Pose, Vec2, segment_in_box};
use n3p::lab::evaluation::oracle;
use n3p::output::PathFile;
use n3p::planners::goals::{self, Terms};
use n3p::planners::{Budget, HybridAStar, HybridAStarConfig, Problem};
use n3p::vehicle::{Margins, Vehicle};
use n3p::world::collision::{CollisionWorld, Contour};
use n3p::world::{DrivableArea, LowObstacles, Obstacles, Scene};
use proptest::prelude::*;

/// The path of `ha-rs`, passed by the independent check, or why there is none.
fn planned(scene: &Scene) -> Result<PathFile, String> {
    let mut planner = HybridAStar::new(HybridAStarConfig::default());
    let planned = goals::plan(&mut planner, scene, Terms::default(), Budget::new(200_000));
    let planned = planned.map_err(|e| e.to_string())?;
    let driven = planned.result.driven().ok_or_else(|| format!("{:?}", planned.result.outcome))?;
    let path = PathFile::of_smooth(scene, &planned.problem.frame, &driven, "ha-rs");
    oracle::check(scene, &path).expect("the independent check passes it");
    Ok(path)
}

/// A street along x with a kerb at y = 0 and parked cars before and behind a gap.
fn street(kerb: impl Fn(&mut Scene, Vec<[f64; 2]>)) -> Scene {
    let car = |x: f64| vec![[x, 0.1], [x + 4.5, 0.1], [x + 4.5, 1.9], [x, 1.9]];
    let mut scene = Scene {
        start: Pose::new(-6.0, 3.6, 0.0),
        goal: Pose::new(1.6, 1.05, 0.0),
        obstacles: vec![car(-5.5), car(7.5)],
        ..Scene::default()
    };
    kerb(&mut scene, vec![[-20.0, 0.0], [20.0, 0.0]]);
    scene
}

#[test]
fn a_polyline_is_its_walls() {
    let chain = vec![[-12.0, 8.0], [3.0, 8.4], [14.0, 7.5]];
    let scene = |walls: Vec<Vec<[f64; 2]>>, polylines| {
        let more = street(|scene, kerb| scene.obstacles.push(kerb));
        Scene { obstacles: [more.obstacles.clone(), walls].concat(), polylines, ..more }
    };
    let walls = scene(chain.windows(2).map(<[_]>::to_vec).collect(), vec![]);
    let polylines = scene(vec![], vec![chain]);
    assert_eq!(planned(&walls).unwrap().poses, planned(&polylines).unwrap().poses);
}

#[test]
fn a_body_passes_over_a_kerb_and_its_wheels_do_not() {
    // Nose in, to where the bumper stands 0.5 m beyond the kerb.
    let vehicle = Vehicle::default();
    let goal_y = -vehicle.front_extent() + 0.5;
    let kerb = vec![[-8.0, 0.0], [8.0, 0.0]];
    let scene = Scene {
        start: Pose::new(-7.0, -9.0, 0.0),
        goal: Pose::new(0.0, goal_y, FRAC_PI_2),
        obstacles: vec![vec![[-4.0, -4.0], [-1.5, -4.0], [-1.5, -0.2], [-4.0, -0.2]]],
        low: LowObstacles { polylines: vec![kerb.clone()], ..LowObstacles::default() },
        ..Scene::default()
    };
    let path = planned(&scene).unwrap();
    let wheels = vehicle.wheel_box(0.0);
    let over = |part: &Aabb| {
        path.poses.iter().any(|&[x, y, heading]| {
            let pose = Pose::new(x, y, heading);
            let [a, b] = [kerb[0], kerb[1]].map(|[x, y]| pose.point_to_local(Vec2::new(x, y)));
            segment_in_box(a, b, part)
        })
    };
    assert!(over(&vehicle.footprint(0.0)) && !over(&wheels));

    // The same kerb as a wall leaves no room, and a goal with its wheels on the kerb is none.
    let wall = Scene { polylines: vec![kerb], low: LowObstacles::default(), ..scene.clone() };
    assert!(planned(&wall).unwrap_err().contains("reaches 0.500 m into polylines[0]"));
    let too_far = Scene { goal: scene.goal.shifted(0.5), ..scene };
    let told = planned(&too_far).unwrap_err();
    assert!(told.contains("low.polylines[0]") && told.contains("wheel"), "{told}");
}

#[test]
fn a_car_stays_in_the_drivable_area_and_out_of_its_holes() {
    let outer = vec![[-10.0, -3.0], [20.0, -3.0], [20.0, 12.0], [-10.0, 12.0]];
    let hole = vec![[4.0, -1.0], [6.0, -1.0], [6.0, 6.5], [4.0, 6.5]];
    let area = DrivableArea { outer, holes: vec![hole] };
    let scene = Scene {
        start: Pose::new(-4.0, 0.0, 0.0),
        goal: Pose::new(10.0, 0.0, 0.0),
        drivable_area: Some(area),
        ..Scene::default()
    };
    let path = planned(&scene).unwrap();
    assert!(path.poses.iter().any(|&[_, y, _]| y > 7.0), "around the hole");
    let outside = Scene { goal: Pose::new(30.0, 0.0, 0.0), ..scene };
    assert!(planned(&outside).unwrap_err().contains("drivable_area"));
}

#[test]
fn more_is_kept_on_the_side_that_asks_for_more() {
    // A wall to the left that the way leads past, and one that is farther on the right.
    let mut scene = Scene {
        start: Pose::new(0.0, 0.0, 0.0),
        goal: Pose::new(14.0, 0.0, 0.0),
        polylines: vec![vec![[5.5, 1.2], [7.0, 1.2]], vec![[5.5, -1.6], [7.0, -1.6]]],
        ..Scene::default()
    };
    let kept = |scene: &Scene, wall_y: f64| {
        let sides = planned(scene).unwrap().poses.into_iter().map(|[x, y, heading]| {
            let pose = Pose::new(x, y, heading);
            let ends = [5.5, 7.0].map(|x| pose.point_to_local(Vec2::new(x, wall_y)));
            let body = scene.vehicle.footprint(0.0);
            let within = |p: &Vec2| (body.min.x..body.max.x).contains(&p.x);
            let beside = ends.into_iter().filter(within).map(|p| p.y.abs() - body.max.y);
            beside.fold(f64::INFINITY, f64::min)
        });
        sides.fold(f64::INFINITY, f64::min)
    };
    scene.margins = Some(Margins { left: 0.5, ..Margins::default() });
    assert!(kept(&scene, 1.2) >= 0.5 - 1e-6);
    // Its mirror image has its margin on the other side, and the mirrored way.
    let mirrored = Scene {
        polylines: scene
            .polylines
            .iter()
            .map(|p| p.iter().map(|&[x, y]| [x, -y]).collect())
            .collect(),
        margins: Some(Margins { right: 0.5, ..Margins::default() }),
        ..scene.clone()
    };
    assert!(kept(&mirrored, -1.2) >= 0.5 - 1e-6);
    scene.margins = Some(Margins { left: 1.1, ..Margins::default() });
    assert!(planned(&scene).unwrap_err().contains("margins.left is 1.1"));
    scene.margins = Some(Margins { mirrors: Some(0.1), ..Margins::default() });
    assert!(planned(&scene).unwrap_err().contains("margins.mirrors is given without a contour"));
}

/// A car 2 m wide with its mirrors, 1.8 m without, whose front corners are cut.
const CONTOUR: [[f64; 2]; 14] = [
    [-1.1, -0.9],
    [1.9, -0.9],
    [1.9, -1.0],
    [2.1, -1.0],
    [2.1, -0.9],
    [3.3, -0.9],
    [3.87, -0.4],
    [3.87, 0.4],
    [3.3, 0.9],
    [2.1, 0.9],
    [2.1, 1.0],
    [1.9, 1.0],
    [1.9, 0.9],
    [-1.1, 0.9],
];

#[test]
fn a_contour_passes_where_its_rectangle_does_not() {
    // A post beside the hood, within the rectangle at the goal.
    let vehicle = Vehicle { width: 2.0, ..Vehicle::default() };
    let scene = Scene {
        vehicle,
        start: Pose::new(-8.0, 0.0, 0.0),
        goal: Pose::new(0.0, 0.0, 0.0),
        points: vec![[3.8, 0.9], [3.0, -0.97]],
        contour: CONTOUR.to_vec(),
        ..Scene::default()
    };
    planned(&scene).unwrap();
    let rectangle = Scene { contour: vec![], ..scene.clone() };
    assert!(planned(&rectangle).unwrap_err().contains("points["));
    let wide = Scene { vehicle: Vehicle::default(), ..scene };
    assert!(planned(&wide).unwrap_err().contains("contour[2]"));
}

#[test]
fn mirrors_pass_where_the_sides_are_to_keep_more() {
    // A gate of 2.1 m, for a car of 2 m with its mirrors.
    let gate = |y: f64| vec![[4.0, y], [4.2, y], [4.2, 9.0 * y], [4.0, 9.0 * y]];
    let mut scene = Scene {
        vehicle: Vehicle { width: 2.0, ..Vehicle::default() },
        start: Pose::new(-8.0, 0.0, 0.0),
        goal: Pose::new(12.0, 0.0, 0.0),
        obstacles: vec![gate(1.05), gate(-1.05)],
        bounds: Some([-14.0, -6.0, 18.0, 6.0]),
        contour: CONTOUR.to_vec(),
        margins: Some(Margins { left: 0.1, right: 0.1, ..Margins::default() }),
        ..Scene::default()
    };
    assert!(planned(&scene).is_err());
    let mirrors =
        |m| Some(Margins { left: 0.1, right: 0.1, mirrors: Some(m), ..Margins::default() });
    scene.margins = mirrors(0.02);
    planned(&scene).unwrap();
    scene.margins = mirrors(0.06);
    assert!(planned(&scene).is_err());
}

proptest! {
    /// A contour's sweep is what a look at every pose along the motion finds.
    #[test]
    fn a_swept_contour_is_seen_by_dense_looks(
        (x, y) in (-6.0..9.0_f64, -6.0..6.0_f64),
        (dx, dy) in (-2.0..2.0_f64, -2.0..2.0_f64),
        curvature in -0.25..0.25_f64,
        length in -6.0..6.0_f64,
    ) {
        let contour = Contour::new(&CONTOUR).unwrap();
        let (a, b) = (Vec2::new(x, y), Vec2::new(x + dx, y + dy));
        prop_assume!(!contour.touches(a, b));
        let segment = Segment { curvature, length };
        let seen_at = |share: f64| {
            let pose = segment.at(Pose::default(), length * share);
            contour.touches(pose.point_to_local(a), pose.point_to_local(b))
        };
        let seen = (0..=4000).any(|i| seen_at(f64::from(i) / 4000.0));
        // Of an edge the first end alone counts as a corner.
        let swept = contour.sweeps(segment, a, b) || contour.sweeps(segment, b, b);
        // A look every 1.5 mm may miss a corner that is just grazed.
        let vehicle = Vehicle { width: 2.0, ..Vehicle::default() };
        prop_assert!(swept || !seen, "tunnels through");
        if swept && !seen {
            let grown = contour.grown(Margins::from(2e-3));
            let near = (0..=4000).any(|i| {
                let pose = segment.at(Pose::default(), length * f64::from(i) / 4000.0);
                grown.touches(pose.point_to_local(a), pose.point_to_local(b))
            });
            prop_assert!(near, "sees what is not there");
        }
        // And so does a world of it.
        let wall = Obstacles::new(vec![], vec![n3p::geometry::Polyline::new(vec![a, b]).unwrap()], vec![]);
        let world = CollisionWorld::of(&wall.unwrap(), None, &vehicle, Some(&contour), 0.0);
        prop_assert_eq!(world.segment_is_free(Pose::default(), segment), !swept);
    }
}

#[test]
fn what_is_wrong_is_named() {
    let base = r#"{"vehicle": {"length": 4.97, "width": 1.86, "wheelbase": 2.83, "rear_overhang": 1.1,
        "max_steer": 0.609}, "start": [0, 0, 0], "goal": [9, 0, 0], "obstacles": []"#;
    let read = |more: &str| Scene::from_json(&format!("{base}, {more}}}"), "scene".as_ref());
    for (more, told) in [
        (r#""polylines": [[[0, 5]]]"#, "polylines[0] has 1 vertex; a polyline needs at least 2"),
        (r#""polylines": 5"#, "polylines is 5; expected a list"),
        (
            r#""low": {"points": [[1, null]]}"#,
            "low.points[0] is [1,null]; expected 2 finite numbers",
        ),
        (r#""low": 3"#, "low is 3; expected an object of points, obstacles, polylines"),
        (r#""low": {"kerbs": []}"#, "kerbs"),
        (
            r#""drivable_area": {"outer": [[0, 0], [1, 0]]}"#,
            "drivable_area.outer has 2 vertices; expected at least 3",
        ),
        (r#""drivable_area": {"holes": []}"#, "outer"),
        (r#""contour": [[0, 0.5], [1, 0]]"#, "contour has 2 vertices; expected 3 to 64"),
        (
            r#""contour": [[0, 0.5], [9, 0], [0, -0.5]]"#,
            "contour[1] = [9, 0] lies outside of the rectangle",
        ),
        (r#""margins": {"left": -1}"#, "margins.left is -1; expected a number from 0 to 1 m"),
        (r#""margins": {"left": "x"}"#, r#"margins.left is "x"; expected a finite number"#),
        (r#""margins": {"mirror": 0}"#, "margins.mirror is unknown; expected front and rear"),
        (r#""start_steer": "x""#, r#"start_steer is "x"; expected a number"#),
    ] {
        let error = read(more).unwrap_err().to_string();
        assert!(error.contains(told), "{more}: {error}");
    }
    let all = r#""polylines": [[[0, 5], [1, 5]]], "low": {"points": [[1, 7]]}, "margins": {"front": 0.2},
        "drivable_area": {"outer": [[-9, -9], [20, -9], [20, 20], [-9, 20]]},
        "contour": [[-1, -0.9], [3.5, -0.5], [3.5, 0.5], [-1, 0.9]]"#;
    let scene = read(all).unwrap();
    let again: Scene = serde_json::from_str(&serde_json::to_string(&scene).unwrap()).unwrap();
    assert_eq!(scene, again);
    assert!(Problem::new(&scene).is_ok());
}
