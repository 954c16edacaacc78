//! Scenes: vehicle, start, goals and lot, as files hold them.

use std::ffi::c_char;
use std::path::Path;

use n3p::world::{Map, MapRequest, Scene};

use super::handles::Table;
use super::memory::{Place, read, read_all, read_text};
use super::status::{Failure, guarded, n3p_status};
use super::types::{n3p_pose, n3p_vehicle};

/// A scene: a vehicle, its start and goals, and what stands around them.
pub enum n3p_scene {}

pub(crate) static SCENES: Table<Scene> = Table::new("n3p_scene", 2);

/// Reads a scene from a file, `.json` (docs/formats.md) or `.csv` (TPCAP); to be freed by
/// n3p_scene_free.
#[doc = safety!(
    "`file` leads to text that ends with a NUL and that nobody changes meanwhile; `scene` leads to \
     room for a handle apart from it."
)]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn n3p_scene_read(
    file: *const c_char,
    scene: *mut *mut n3p_scene,
) -> n3p_status {
    guarded(|| {
        // SAFETY: what this function asks for.
        let (file, scene) = unsafe { (read_text(file, "file"), Place::new(scene, "scene")?) };
        scene.put(std::ptr::null_mut());
        let read = Scene::read(Path::new(file?)).map_err(|e| Failure::bad_input(e.to_string()))?;
        scene.put(SCENES.open(read));
        Ok(())
    })
}

/// Reads a map of any kind (docs/formats.md) and makes it a scene: an occupancy grid (`.yaml`), points (`.csv`, `.pcd`),
/// `.geojson`, CommonRoad (`.xml`), OpenDRIVE (`.xodr`) or a scene; to be freed by n3p_scene_free. `vehicle`, `start` and
/// `goals` take the place of the map's, where it has any; NULL, and a count of 0, leave the map's as they are.
#[doc = safety!(
    "`file` leads to text that ends with a NUL, `vehicle` and `start`, where they are not NULL, to such structs, and `goals` to \
     `goal_count` poses, all of which nobody changes meanwhile; `scene` leads to room for a handle apart from them."
)]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn n3p_scene_read_map(
    file: *const c_char,
    vehicle: *const n3p_vehicle,
    start: *const n3p_pose,
    goals: *const n3p_pose,
    goal_count: usize,
    scene: *mut *mut n3p_scene,
) -> n3p_status {
    guarded(|| {
        // SAFETY: what this function asks for.
        let (file, scene) = unsafe { (read_text(file, "file"), Place::new(scene, "scene")?) };
        scene.put(std::ptr::null_mut());
        // SAFETY: the same.
        let (vehicle, start, goals) = unsafe {
            let vehicle = (!vehicle.is_null()).then(|| read(vehicle, "vehicle")).transpose()?;
            let start = (!start.is_null()).then(|| read(start, "start")).transpose()?;
            (vehicle, start, read_all(goals, goal_count, "goals")?)
        };
        let request = MapRequest {
            start: start.map(Into::into),
            goals: goals.iter().map(|&goal| goal.into()).collect(),
            vehicle: vehicle.map(Into::into),
        };
        let made = Map::read(Path::new(file?)).and_then(|map| map.scene(&request));
        scene.put(SCENES.open(made.map_err(|e| Failure::bad_input(e.to_string()))?));
        Ok(())
    })
}

/// Reads a scene from `length` bytes of JSON (docs/formats.md); to be freed by n3p_scene_free.
#[doc = safety!(
    "`json` leads to `length` bytes, which nobody changes meanwhile; `scene` leads to room for a \
     handle apart from them."
)]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn n3p_scene_from_json(
    json: *const c_char,
    length: usize,
    scene: *mut *mut n3p_scene,
) -> n3p_status {
    guarded(|| {
        // SAFETY: what this function asks for.
        let (json, scene) =
            unsafe { (read_all(json.cast::<u8>(), length, "json"), Place::new(scene, "scene")?) };
        scene.put(std::ptr::null_mut());
        let json =
            str::from_utf8(json?).map_err(|_| Failure::bad_input("json is not text (UTF-8)"))?;
        let read = Scene::from_json(json, Path::new("json"))
            .map_err(|e| Failure::bad_input(e.to_string()))?;
        scene.put(SCENES.open(read));
        Ok(())
    })
}

/// Frees a scene; NULL is none.
#[unsafe(no_mangle)]
pub extern "C" fn n3p_scene_free(scene: *mut n3p_scene) -> n3p_status {
    guarded(|| SCENES.close(scene))
}

/// The scene's vehicle, for which a parker must be made to plan it.
#[doc = safety!("`vehicle` leads to room for such a struct.")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn n3p_scene_vehicle(
    scene: *const n3p_scene,
    vehicle: *mut n3p_vehicle,
) -> n3p_status {
    guarded(|| {
        // SAFETY: what this function asks for.
        let vehicle = unsafe { Place::new(vehicle, "vehicle") }?;
        vehicle.put(SCENES.get(scene, "scene")?.vehicle.into());
        Ok(())
    })
}
