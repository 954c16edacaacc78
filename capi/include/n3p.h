/* N3P: plans how a car parks. The guide is docs/c.md.
 *
 * Lengths in metres, angles in radians, counter-clockwise; a pose is that of the centre of the
 * rear axle, and headings are those of the nose from the x axis.
 *
 * Made of capi/src by cbindgen; not to be edited. */

#ifndef N3P_H
#define N3P_H

#include <stddef.h>
#include <stdint.h>

/**
 * The most points, vertices or cells of one call, and the most bytes of a text. Beyond it a count
 * is a mistake.
 */
#define N3P_MAX_COUNT (1 << 24)

/**
 * What a function came to. The numbers are also the exit codes of n3p-plan, as far as those go.
 */
typedef enum n3p_status {
    /**
     * Done.
     */
    N3P_OK = 0,
    /**
     * A bug of the library. Whatever it happened to can still be used.
     */
    N3P_INTERNAL = 1,
    /**
     * What was given cannot be used: a number that is none, NULL, a handle that is not open, a
     * start that is not free. The message says which, and what would be right.
     */
    N3P_BAD_INPUT = 2,
    /**
     * There is no path, or none was found within the budget.
     */
    N3P_NO_PATH = 3,
    /**
     * The buffer is too small, and nothing was written to it; the count says how much it takes. Of
     * a text the length says it, which counts no NUL: the buffer needs a capacity of one more.
     */
    N3P_BUFFER_TOO_SMALL = 4,
} n3p_status;

/**
 * What becomes of a first path.
 */
typedef enum n3p_effort {
    /**
     * Where it costs more than usual, something cheaper is looked for.
     */
    N3P_EFFORT_USUAL = 0,
    /**
     * It is the answer.
     */
    N3P_EFFORT_FIRST = 1,
    /**
     * Something cheaper is always looked for, with half of the budget.
     */
    N3P_EFFORT_MOST = 2,
} n3p_effort;

/**
 * Where the steering wheel may be turned while the car stands. Elsewhere it turns as the car drives, and
 * the steering angle is continuous.
 */
typedef enum n3p_standstill_steering {
    /**
     * Wherever the curvature jumps: paths are arcs and straights.
     */
    N3P_STEERING_ANYWHERE = 0,
    /**
     * Where the gear changes, and at the start where nothing else fits.
     */
    N3P_STEERING_AT_CHANGES = 1,
    /**
     * Nowhere.
     */
    N3P_STEERING_NEVER = 2,
} n3p_standstill_steering;

/**
 * How the goal lies in its spot.
 */
typedef enum n3p_parking_type {
    /**
     * To be found from the obstacles around.
     */
    N3P_PARKING_ANY = 0,
    /**
     * A bay, nose in.
     */
    N3P_PARKING_FORWARD = 1,
    /**
     * A bay, tail in.
     */
    N3P_PARKING_REVERSE = 2,
    /**
     * Along the lane.
     */
    N3P_PARKING_PARALLEL = 3,
    /**
     * A bay at 30 to 150 degrees to the lane, nose in or tail in.
     */
    N3P_PARKING_ANGLED = 4,
} n3p_parking_type;

/**
 * What stands in a lot, in any frame that it shares with start and goal.
 */
typedef struct n3p_lot n3p_lot;

/**
 * Plans for one vehicle.
 */
typedef struct n3p_parker n3p_parker;

/**
 * A path that the exact swept check has passed, and how it came about.
 */
typedef struct n3p_plan n3p_plan;

/**
 * A scene: a vehicle, its start and goals, and what stands around them.
 */
typedef struct n3p_scene n3p_scene;

/**
 * A vehicle.
 */
typedef struct n3p_vehicle {
    /**
     * Bumper to bumper, metres.
     */
    double length;
    /**
     * Side to side, metres.
     */
    double width;
    /**
     * Rear to front axle, metres.
     */
    double wheelbase;
    /**
     * Rear axle to rear bumper, metres.
     */
    double rear_overhang;
    /**
     * Largest angle of the front wheels, radians.
     */
    double max_steer;
    /**
     * Speed when driving forward, m/s; only trajectories depend on it.
     */
    double forward_speed;
    /**
     * Speed when driving backward, m/s; positive.
     */
    double backward_speed;
    /**
     * How fast the front wheels turn, rad/s; only trajectories depend on it. 0: as usual, 0.6.
     */
    double steer_rate;
} n3p_vehicle;

/**
 * How fast a path may be driven. The speeds are the vehicle's.
 */
typedef struct n3p_limits {
    /**
     * Largest acceleration and braking when driving forward, m/s².
     */
    double forward_acceleration;
    /**
     * The same when driving backward, m/s².
     */
    double backward_acceleration;
    /**
     * Largest v²·|κ| at the rear axle, m/s².
     */
    double lateral_acceleration;
    /**
     * How fast the acceleration changes at most, m/s³.
     */
    double jerk;
    /**
     * How fast the front wheels turn, rad/s.
     */
    double steer_rate;
    /**
     * Not 0: the car stops wherever the steering angle jumps.
     */
    int32_t stop_to_steer;
} n3p_limits;

/**
 * A pose of the centre of the rear axle.
 */
typedef struct n3p_pose {
    /**
     * Metres.
     */
    double x;
    /**
     * Metres.
     */
    double y;
    /**
     * Radians, counter-clockwise from the x axis.
     */
    double heading;
} n3p_pose;

/**
 * How a parker plans. All zeros are the defaults.
 */
typedef struct n3p_options {
    /**
     * A method's name, such as "n3p" or "ha-rs"; NULL: "n3p" where the models serve the vehicle,
     * else "ha-rs".
     */
    const char *method;
    /**
     * Distance from obstacles where start and goal allow it, metres, 0 to 1; less than 0.005 means
     * that.
     */
    double margin;
    /**
     * How deep start and goal may reach into obstacles, metres, 0 to 0.2.
     */
    double allow_contact;
    /**
     * Most node expansions of a plan; 0: 200,000. Work is counted, never time, so that plans are
     * the same everywhere.
     */
    size_t max_expansions;
    /**
     * What becomes of a first path, an n3p_effort.
     */
    int32_t effort;
    /**
     * Where the steering wheel may be turned while the car stands, an n3p_standstill_steering.
     */
    int32_t standstill_steering;
} n3p_options;

/**
 * Distances on each side of a car, metres.
 */
typedef struct n3p_margins {
    /**
     * Ahead of it.
     */
    double front;
    /**
     * Behind it.
     */
    double rear;
    /**
     * On its left.
     */
    double left;
    /**
     * On its right.
     */
    double right;
    /**
     * Around its mirrors: what of the contour stands out farther to either side than the body does at
     * the rear axle; 0 for the sides'.
     */
    double mirrors;
} n3p_margins;

/**
 * What is asked of a plan besides avoiding obstacles.
 */
typedef struct n3p_request {
    /**
     * Where the car stands.
     */
    struct n3p_pose start;
    /**
     * Where it may park; the cheapest is taken.
     */
    const struct n3p_pose *goals;
    /**
     * How many goals, 1 to 256.
     */
    size_t goal_count;
    /**
     * How far from a goal the car may stop, metres, 0 to 1.
     */
    double position_tolerance;
    /**
     * How far it may be turned there to either side, radians, 0 to 0.5.
     */
    double heading_tolerance;
    /**
     * How the goal lies in its spot, an n3p_parking_type.
     */
    int32_t parking_type;
    /**
     * Distance to keep ahead of the car, behind it, and on either side, metres, 0 to 1; 0 for the
     * parker's own.
     */
    struct n3p_margins margins;
    /**
     * The car's outline in its own frame, x and y of each vertex in turn, within the rectangle of its
     * sizes; NULL where it is that rectangle.
     */
    const double *contour;
    /**
     * How many vertices the outline has, 3 to 64; 0 for none.
     */
    size_t contour_count;
    /**
     * Angle of the front wheels at the start, radians, positive to the left.
     */
    double start_steer;
    /**
     * The plan that the car follows already, which is kept while it is free and near the best; NULL
     * for none.
     */
    const struct n3p_plan *previous;
} n3p_request;

/**
 * What a plan came to.
 */
typedef struct n3p_summary {
    /**
     * Driven length, metres.
     */
    double length;
    /**
     * Distance kept from what is next to start or goal, metres; from all else at least the margin
     * asked for.
     */
    double margin;
    /**
     * Changes between forward and backward.
     */
    size_t direction_changes;
    /**
     * Node expansions that it took.
     */
    size_t expansions;
    /**
     * Which goal it leads to, from 0.
     */
    size_t goal_index;
    /**
     * How the goal lies in its spot, given or found: an n3p_parking_type.
     */
    int32_t parking_type;
    /**
     * The method's name.
     */
    char method[16];
    /**
     * How n3p came to it: "library", "direct", "searched", "fallback", "no-lane", "no-spot", or "kept"; "" by
     * other methods.
     */
    char route[16];
} n3p_summary;

/**
 * A pose of a path, and how it is driven on from there.
 */
typedef struct n3p_path_pose {
    /**
     * Metres.
     */
    double x;
    /**
     * Metres.
     */
    double y;
    /**
     * Radians.
     */
    double heading;
    /**
     * Angle of the front wheels on the way to the next pose, radians, positive to the left; at the
     * end that which led there.
     */
    double steer;
    /**
     * Angle of the front wheels at this pose, and with which the way to the next one ends: they differ from
     * `steer` where the steering angle changes on the way.
     */
    double steer_from;
    /**
     * See `steer_from`.
     */
    double steer_to;
    /**
     * Gear on the way to the next pose: 1 forward, -1 backward; at the end that which led there.
     */
    int32_t gear;
} n3p_path_pose;

/**
 * A moment of a driven path.
 */
typedef struct n3p_moment {
    /**
     * Since the start, seconds.
     */
    double time;
    /**
     * Metres.
     */
    double x;
    /**
     * Metres.
     */
    double y;
    /**
     * Radians.
     */
    double heading;
    /**
     * m/s, negative backward.
     */
    double speed;
    /**
     * Rate of change of the speed from now on, m/s².
     */
    double acceleration;
    /**
     * Angle of the front wheels, radians, positive to the left.
     */
    double steer;
    /**
     * Curvature of an arc driven with this angle, 1/m.
     */
    double curvature;
    /**
     * Driven since the start, metres.
     */
    double distance;
    /**
     * 1 forward, -1 backward.
     */
    int32_t gear;
} n3p_moment;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/**
 * The message of the last call of this thread that did not return N3P_OK; "" where there was none.
 * English, without a line break at its end. Valid until the next such call of this thread.
 */
const char *n3p_last_error(void);

/**
 * The library's version, such as "0.1.0".
 */
const char *n3p_version(void);

/**
 * The paper's car, a 2024 Honda Accord.
 */
struct n3p_vehicle n3p_vehicle_default(void);

/**
 * 1 m/s² in both gears, 2 m/s² to the side, 2 m/s³, 0.6 rad/s, and no stops to steer.
 */
struct n3p_limits n3p_limits_default(void);

/**
 * Makes an empty lot, to be freed by n3p_lot_free.
 */
enum n3p_status n3p_lot_new(struct n3p_lot **lot);

/**
 * Frees a lot; NULL is none.
 */
enum n3p_status n3p_lot_free(struct n3p_lot *lot);

/**
 * Removes everything from a lot, the bounds too.
 */
enum n3p_status n3p_lot_clear(struct n3p_lot *lot);

/**
 * Adds a solid simple polygon, closed implicitly, its vertices in either direction; two vertices
 * are a wall. `xy` holds x and y of each vertex in turn, 2 `count` numbers.
 */
enum n3p_status n3p_lot_polygon(struct n3p_lot *lot, const double *xy, size_t count);

/**
 * Adds a line without thickness, such as a fence; `xy` as in n3p_lot_polygon.
 */
enum n3p_status n3p_lot_polyline(struct n3p_lot *lot, const double *xy, size_t count);

/**
 * Adds a solid that only wheels must keep off, such as a traffic island; `xy` as in n3p_lot_polygon.
 */
enum n3p_status n3p_lot_low_polygon(struct n3p_lot *lot,
                                    const double *xy,
                                    size_t count);

/**
 * Adds a line that only wheels must keep off, such as a kerb; `xy` as in n3p_lot_polygon.
 */
enum n3p_status n3p_lot_low_polyline(struct n3p_lot *lot, const double *xy, size_t count);

/**
 * Keeps the car's body within a polygon, instead of one given before; `xy` as in n3p_lot_polygon. What is
 * left out of it are polygons that stand there.
 */
enum n3p_status n3p_lot_drivable_area(struct n3p_lot *lot,
                                      const double *xy,
                                      size_t count);

/**
 * Adds points, as a range sensor sees them; `xy` as in n3p_lot_polygon.
 */
enum n3p_status n3p_lot_points(struct n3p_lot *lot, const double *xy, size_t count);

/**
 * Keeps the rear axle within a rectangle, instead of one given before.
 */
enum n3p_status n3p_lot_bounds(struct n3p_lot *lot,
                               double x_min,
                               double y_min,
                               double x_max,
                               double y_max);

/**
 * Adds the occupied cells of a grid, those that are not 0. `cells` holds `rows` rows of `columns`
 * cells, the row of the lowest y first; (`x`, `y`) is the corner of the first cell with the lowest
 * x and y, and `resolution` the side of a cell, metres.
 */
enum n3p_status n3p_lot_grid(struct n3p_lot *lot,
                             double x,
                             double y,
                             double resolution,
                             size_t columns,
                             size_t rows,
                             const uint8_t *cells);

/**
 * Reads a scene from a file, `.json` (docs/formats.md) or `.csv` (TPCAP); to be freed by
 * n3p_scene_free.
 */
enum n3p_status n3p_scene_read(const char *file, struct n3p_scene **scene);

/**
 * Reads a map of any kind (docs/formats.md) and makes it a scene: an occupancy grid (`.yaml`), points (`.csv`, `.pcd`),
 * `.geojson`, CommonRoad (`.xml`), OpenDRIVE (`.xodr`) or a scene; to be freed by n3p_scene_free. `vehicle`, `start` and
 * `goals` take the place of the map's, where it has any; NULL, and a count of 0, leave the map's as they are.
 */
enum n3p_status n3p_scene_read_map(const char *file,
                                   const struct n3p_vehicle *vehicle,
                                   const struct n3p_pose *start,
                                   const struct n3p_pose *goals,
                                   size_t goal_count,
                                   struct n3p_scene **scene);

/**
 * Reads a scene from `length` bytes of JSON (docs/formats.md); to be freed by n3p_scene_free.
 */
enum n3p_status n3p_scene_from_json(const char *json, size_t length, struct n3p_scene **scene);

/**
 * Frees a scene; NULL is none.
 */
enum n3p_status n3p_scene_free(struct n3p_scene *scene);

/**
 * The scene's vehicle, for which a parker must be made to plan it.
 */
enum n3p_status n3p_scene_vehicle(const struct n3p_scene *scene, struct n3p_vehicle *vehicle);

/**
 * Makes a parker for a vehicle, with the models that are compiled in; to be freed by
 * n3p_parker_free. NULL options are the defaults.
 */
enum n3p_status n3p_parker_new(const struct n3p_vehicle *vehicle,
                               const struct n3p_options *options,
                               struct n3p_parker **parker);

/**
 * Frees a parker; NULL is none. Plans of other threads that are under way end well.
 */
enum n3p_status n3p_parker_free(struct n3p_parker *parker);

/**
 * Plans from `start` to `goal` among what stands in `lot`. `plan` is to be freed by n3p_plan_free;
 * it is NULL unless the function returns N3P_OK.
 */
enum n3p_status n3p_parker_plan(const struct n3p_parker *parker,
                                struct n3p_pose start,
                                struct n3p_pose goal,
                                const struct n3p_lot *lot,
                                struct n3p_plan **plan);

/**
 * Plans a request, which may have several goals, a tolerance and a parking type, among what stands
 * in `lot`. `plan` as in n3p_parker_plan.
 */
enum n3p_status n3p_parker_plan_request(const struct n3p_parker *parker,
                                        const struct n3p_request *request,
                                        const struct n3p_lot *lot,
                                        struct n3p_plan **plan);

/**
 * Plans a scene, whose vehicle must be the parker's. `plan` as in n3p_parker_plan.
 */
enum n3p_status n3p_parker_plan_scene(const struct n3p_parker *parker,
                                      const struct n3p_scene *scene,
                                      struct n3p_plan **plan);

/**
 * Plans `count` requests by all cores, each in its lot, which several may share; the plans are the
 * same as one by one. `plans` and `statuses`, which may be NULL, have room for as many: of a
 * request that has no plan, the plan is NULL and the status says why.
 *
 * Returns N3P_OK where all have plans, and else the status of the first that has none, which the
 * message is about. Where an argument cannot be used nothing is planned: all plans are NULL, and
 * all statuses are what is returned.
 */
enum n3p_status n3p_parker_plan_batch(const struct n3p_parker *parker,
                                      const struct n3p_request *requests,
                                      const struct n3p_lot *const *lots,
                                      size_t count,
                                      struct n3p_plan **plans,
                                      enum n3p_status *statuses);

/**
 * Frees a plan; NULL is none.
 */
enum n3p_status n3p_plan_free(struct n3p_plan *plan);

/**
 * What the plan came to.
 */
enum n3p_status n3p_plan_summary(const struct n3p_plan *plan, struct n3p_summary *summary);

/**
 * Writes the path to `buffer`, which has room for `capacity` poses: poses at most 5 cm apart, the
 * first the start. `count` becomes their number; where that is more than `capacity`, nothing else
 * is written and the function returns N3P_BUFFER_TOO_SMALL. NULL with a capacity of 0 asks for the
 * number alone.
 */
enum n3p_status n3p_plan_poses(const struct n3p_plan *plan,
                               struct n3p_path_pose *buffer,
                               size_t capacity,
                               size_t *count);

/**
 * Writes the path in time to `buffer`, as n3p_plan_poses does: moments 0.05 s apart, and the end.
 * NULL limits are those of n3p_limits_default.
 */
enum n3p_status n3p_plan_trajectory(const struct n3p_plan *plan,
                                    const struct n3p_limits *limits,
                                    struct n3p_moment *buffer,
                                    size_t capacity,
                                    size_t *count);

/**
 * Writes the path to `buffer` as the JSON of path files (docs/formats.md), byte by byte what
 * n3p-plan --out writes, and a NUL. `length` becomes the number of bytes without the NUL: the
 * buffer needs a capacity of one more. Otherwise as n3p_plan_poses.
 */
enum n3p_status n3p_plan_json(const struct n3p_plan *plan,
                              char *buffer,
                              size_t capacity,
                              size_t *length);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* N3P_H */
