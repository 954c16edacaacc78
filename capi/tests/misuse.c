/* What nobody should do gives codes with messages, and never aborts. Run by run.sh, also under
 * valgrind. */
#include <math.h>
#include <n3p.h>
#include <pthread.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int faults = 0;

/* One call, the code that it should give, and a part of its message. */
#define EXPECT(call, code, part)                                                                   \
    do {                                                                                           \
        const n3p_status status_ = (call);                                                         \
        if (status_ != (code) || (status_ != N3P_OK && !strstr(n3p_last_error(), (part)))) {       \
            faults++;                                                                              \
            fprintf(stderr, "line %d: %s: code %d, expected %d with \"%s\"; message: %s\n",        \
                    __LINE__, #call, status_, (code), (part), n3p_last_error());                   \
        }                                                                                          \
    } while (0)
#define OK(call) EXPECT(call, N3P_OK, "")
#define BAD(call, part) EXPECT(call, N3P_BAD_INPUT, part)
#define HOLDS(condition)                                                                           \
    do {                                                                                           \
        if (!(condition)) {                                                                        \
            faults++;                                                                              \
            fprintf(stderr, "line %d: not so: %s\n", __LINE__, #condition);                        \
        }                                                                                          \
    } while (0)

static const double LEFT[] = {-4.1, -2.6, -1.6, -2.6, -1.6, 2.4, -4.1, 2.4};
static const double RIGHT[] = {1.6, -2.6, 4.1, -2.6, 4.1, 2.4, 1.6, 2.4};
static const double KERB[] = {-15.0, 9.5, 15.0, 9.5};
static const n3p_pose START = {-9.0, 6.0, 0.0};
static const n3p_pose GOAL = {0.0, -1.4, 1.5707963267948966};

static n3p_lot *usual_lot(void) {
    n3p_lot *lot = NULL;
    OK(n3p_lot_new(&lot));
    OK(n3p_lot_polygon(lot, LEFT, 4));
    OK(n3p_lot_polygon(lot, RIGHT, 4));
    OK(n3p_lot_polyline(lot, KERB, 2));
    return lot;
}

static n3p_parker *usual_parker(void) {
    const n3p_vehicle car = n3p_vehicle_default();
    n3p_parker *parker = NULL;
    OK(n3p_parker_new(&car, NULL, &parker));
    return parker;
}

static void parkers(void) {
    n3p_parker *parker = (n3p_parker *)&faults;
    n3p_vehicle car = n3p_vehicle_default();
    BAD(n3p_parker_new(NULL, NULL, &parker), "vehicle is NULL");
    HOLDS(parker == NULL);
    BAD(n3p_parker_new(&car, NULL, NULL), "parker is NULL");
    BAD(n3p_parker_new((const n3p_vehicle *)((const char *)&car + 1), NULL, &parker), "aligned");
    car.width = NAN;
    BAD(n3p_parker_new(&car, NULL, &parker), "vehicle.width is NaN");
    car.width = INFINITY;
    BAD(n3p_parker_new(&car, NULL, &parker), "vehicle.width is inf");
    car = n3p_vehicle_default();
    car.max_steer = 35.0;
    BAD(n3p_parker_new(&car, NULL, &parker), "degrees");
    memset(&car, 0, sizeof car);
    BAD(n3p_parker_new(&car, NULL, &parker), "vehicle.length is 0");

    car = n3p_vehicle_default();
    n3p_options options;
    memset(&options, 0, sizeof options);
    options.method = "teleport";
    BAD(n3p_parker_new(&car, &options, &parker), "teleport");
    options.method = "\xff\xfe";
    BAD(n3p_parker_new(&car, &options, &parker), "UTF-8");
    options.method = "rl-eval";
    BAD(n3p_parker_new(&car, &options, &parker), "rl-eval is a policy");
    options.method = NULL;
    options.margin = NAN;
    BAD(n3p_parker_new(&car, &options, &parker), "margin is NaN");
    options.margin = -1.0;
    BAD(n3p_parker_new(&car, &options, &parker), "margin is -1");
    options.margin = 0.0;
    options.allow_contact = INFINITY;
    BAD(n3p_parker_new(&car, &options, &parker), "contact is inf");
    options.allow_contact = 0.0;
    options.effort = 7;
    BAD(n3p_parker_new(&car, &options, &parker), "effort is 7");
    options.effort = N3P_EFFORT_FIRST;
    options.method = "ha-rs";
    OK(n3p_parker_new(&car, &options, &parker));
    OK(n3p_parker_free(parker));

    /* A bus, which nobody has learnt to park: plans all the same. */
    car.length = 12.0;
    car.width = 2.5;
    car.wheelbase = 6.0;
    car.rear_overhang = 3.0;
    OK(n3p_parker_new(&car, NULL, &parker));
    n3p_lot *lot = NULL;
    OK(n3p_lot_new(&lot));
    n3p_plan *plan = NULL;
    const n3p_pose ahead = {10.0, 0.0, 0.0}, here = {0.0, 0.0, 0.0};
    OK(n3p_parker_plan(parker, here, ahead, lot, &plan));
    OK(n3p_plan_free(plan));
    OK(n3p_lot_free(lot));
    OK(n3p_parker_free(parker));
}

static void lots(void) {
    n3p_lot *lot = usual_lot();
    BAD(n3p_lot_new(NULL), "lot is NULL");
    BAD(n3p_lot_clear(NULL), "lot is NULL");
    BAD(n3p_lot_polygon(NULL, LEFT, 4), "lot is NULL");
    BAD(n3p_lot_polygon(lot, NULL, 4), "xy is NULL");
    BAD(n3p_lot_polygon(lot, LEFT, 0), "count of 0");
    BAD(n3p_lot_polygon(lot, LEFT, 1), "count of 1");
    BAD(n3p_lot_polygon(lot, LEFT, SIZE_MAX), "at most");
    BAD(n3p_lot_polygon(lot, LEFT, (size_t)N3P_MAX_COUNT + 1), "at most");
    BAD(n3p_lot_polygon(lot, (const double *)((const char *)LEFT + 1), 3), "aligned");
    BAD(n3p_lot_polyline(lot, KERB, 1), "count of 1");
    BAD(n3p_lot_points(lot, NULL, 1), "xy is NULL");
    OK(n3p_lot_points(lot, NULL, 0));
    double broken[] = {0.0, 0.0, 1.0, NAN, 1.0, 1.0};
    BAD(n3p_lot_polygon(lot, broken, 3), "point 1 of xy is (1, NaN)");
    broken[3] = -INFINITY;
    BAD(n3p_lot_points(lot, broken, 3), "point 1 of xy is (1, -inf)");
    BAD(n3p_lot_bounds(lot, 0.0, 0.0, NAN, 1.0), "bounds");
    BAD(n3p_lot_bounds(lot, 0.0, 0.0, 0.0, 1.0), "bounds");
    const uint8_t cells[] = {0, 1, 255, 0};
    BAD(n3p_lot_grid(lot, 0.0, 0.0, 0.0, 2, 2, cells), "larger than 0");
    BAD(n3p_lot_grid(lot, NAN, 0.0, 0.1, 2, 2, cells), "finite");
    BAD(n3p_lot_grid(lot, 0.0, 0.0, 0.1, SIZE_MAX, 2, cells), "cells");
    BAD(n3p_lot_grid(lot, 0.0, 0.0, 0.1, 2, 2, NULL), "cells is NULL");
    OK(n3p_lot_grid(lot, 20.0, 20.0, 0.1, 2, 2, cells));
    OK(n3p_lot_grid(lot, 20.0, 20.0, 0.1, 0, 2, NULL));
    OK(n3p_lot_clear(lot));
    OK(n3p_lot_free(lot));
}

static void closed(void) {
    n3p_parker *parker = usual_parker();
    n3p_lot *lot = usual_lot();
    n3p_plan *plan = NULL;
    size_t count = 0;
    OK(n3p_parker_plan(parker, START, GOAL, lot, &plan));
    OK(n3p_plan_free(plan));
    BAD(n3p_plan_free(plan), "plan is no open n3p_plan");
    BAD(n3p_plan_poses(plan, NULL, 0, &count), "plan is no open n3p_plan");
    OK(n3p_plan_free(NULL));
    /* Handles of another kind, and pointers that are none. */
    BAD(n3p_lot_free((n3p_lot *)parker), "lot is no open n3p_lot");
    BAD(n3p_lot_polygon((n3p_lot *)&faults, LEFT, 4), "lot is no open n3p_lot");
    BAD(n3p_parker_plan((n3p_parker *)lot, START, GOAL, lot, &plan), "parker is no open");
    HOLDS(plan == NULL);
    OK(n3p_lot_free(lot));
    BAD(n3p_lot_polygon(lot, LEFT, 4), "lot is no open n3p_lot");
    BAD(n3p_parker_plan(parker, START, GOAL, lot, &plan), "lot is no open n3p_lot");
    OK(n3p_parker_free(parker));
    lot = usual_lot();
    BAD(n3p_parker_plan(parker, START, GOAL, lot, &plan), "parker is no open n3p_parker");
    OK(n3p_lot_free(lot));
}

static void plans(void) {
    n3p_parker *parker = usual_parker();
    n3p_lot *lot = usual_lot();
    n3p_plan *plan = NULL;
    BAD(n3p_parker_plan(NULL, START, GOAL, lot, &plan), "parker is NULL");
    BAD(n3p_parker_plan(parker, START, GOAL, NULL, &plan), "lot is NULL");
    BAD(n3p_parker_plan(parker, START, GOAL, lot, NULL), "plan is NULL");
    n3p_pose start = START, goal = GOAL;
    start.heading = NAN;
    BAD(n3p_parker_plan(parker, start, GOAL, lot, &plan), "start");
    goal.x = INFINITY;
    BAD(n3p_parker_plan(parker, START, goal, lot, &plan), "goal");
    goal.x = 1e300;
    BAD(n3p_parker_plan(parker, START, goal, lot, &plan), "goal");
    /* In the car to the right, the second polygon. */
    start = (n3p_pose){2.0, 0.0, 0.0};
    BAD(n3p_parker_plan(parker, start, GOAL, lot, &plan), "into obstacles[1]");
    goal = (n3p_pose){-2.0, 0.0, 0.0};
    BAD(n3p_parker_plan(parker, START, goal, lot, &plan), "into obstacles[0]");
    HOLDS(plan == NULL);

    n3p_request request;
    memset(&request, 0, sizeof request);
    request.start = START;
    BAD(n3p_parker_plan_request(parker, NULL, lot, &plan), "request is NULL");
    BAD(n3p_parker_plan_request(parker, &request, lot, &plan), "goal_count is 0");
    request.goal_count = 1;
    BAD(n3p_parker_plan_request(parker, &request, lot, &plan), "goals is NULL");
    request.goals = &GOAL;
    request.goal_count = SIZE_MAX;
    BAD(n3p_parker_plan_request(parker, &request, lot, &plan), "goal_count");
    request.goal_count = 1;
    request.parking_type = -1;
    BAD(n3p_parker_plan_request(parker, &request, lot, &plan), "parking_type is -1");
    request.parking_type = N3P_PARKING_REVERSE;
    request.position_tolerance = NAN;
    BAD(n3p_parker_plan_request(parker, &request, lot, &plan), "position_m is NaN");
    request.position_tolerance = 0.05;
    request.heading_tolerance = -0.1;
    BAD(n3p_parker_plan_request(parker, &request, lot, &plan), "heading_rad is -0.1");
    request.heading_tolerance = 0.02;
    request.margins.left = 2.0;
    BAD(n3p_parker_plan_request(parker, &request, lot, &plan), "margins.left is 2");
    request.margins.left = 0.05;
    request.start_steer = NAN;
    BAD(n3p_parker_plan_request(parker, &request, lot, &plan), "start_steer is NaN");
    request.start_steer = 0.1;
    request.contour_count = 4;
    BAD(n3p_parker_plan_request(parker, &request, lot, &plan), "contour is NULL");
    const double wrong[] = {-1.1, -0.93, 3.87, -0.6, 3.87, 0.6, 9.0, 0.93};
    request.contour = wrong;
    BAD(n3p_parker_plan_request(parker, &request, lot, &plan), "contour[3]");
    const double contour[] = {-1.1, -0.93, 3.87, -0.6, 3.87, 0.6, -1.1, 0.93};
    request.contour = contour;
    OK(n3p_parker_plan_request(parker, &request, lot, &plan));
    request.previous = plan;
    n3p_plan *kept = NULL;
    OK(n3p_parker_plan_request(parker, &request, lot, &kept));
    OK(n3p_plan_free(kept));
    request.previous = (const n3p_plan *)lot;
    BAD(n3p_parker_plan_request(parker, &request, lot, &kept), "previous");
    request.previous = NULL;
    OK(n3p_plan_free(plan));

    /* A polygon of no size, and one too far away to be told from others near it. */
    n3p_lot *other = NULL;
    const double same[] = {20.0, 20.0, 20.0, 20.0, 20.0, 20.0};
    const double far[] = {1e12, 0.0, 1e12, 1.0, 1e12, 2.0};
    OK(n3p_lot_new(&other));
    OK(n3p_lot_polygon(other, LEFT, 4));
    OK(n3p_lot_polygon(other, same, 3));
    (void)n3p_parker_plan(parker, START, GOAL, other, &plan);
    (void)n3p_plan_free(plan);
    OK(n3p_lot_polygon(other, far, 3));
    BAD(n3p_parker_plan(parker, START, GOAL, other, &plan), "obstacles[2]");
    OK(n3p_lot_clear(other));
    /* A wall all around the goal. */
    const double wall[] = {-3, -5, 3, -5, 3, 5, -3, 5, -3, -5};
    OK(n3p_lot_polyline(other, wall, 5));
    EXPECT(n3p_parker_plan(parker, START, GOAL, other, &plan), N3P_NO_PATH, "no path");
    HOLDS(plan == NULL);
    OK(n3p_lot_free(other));
    OK(n3p_lot_free(lot));
    OK(n3p_parker_free(parker));
}

static void buffers(void) {
    n3p_parker *parker = usual_parker();
    n3p_lot *lot = usual_lot();
    n3p_plan *plan = NULL;
    OK(n3p_parker_plan(parker, START, GOAL, lot, &plan));
    n3p_summary summary;
    BAD(n3p_plan_summary(plan, NULL), "summary is NULL");
    BAD(n3p_plan_summary(NULL, &summary), "plan is NULL");
    OK(n3p_plan_summary(plan, &summary));
    HOLDS(summary.length > 10.0 && !strcmp(summary.method, "n3p"));

    size_t count = 0;
    BAD(n3p_plan_poses(plan, NULL, 0, NULL), "count is NULL");
    EXPECT(n3p_plan_poses(plan, NULL, 0, &count), N3P_BUFFER_TOO_SMALL, "room for 0");
    HOLDS(count > 100);
    BAD(n3p_plan_poses(plan, NULL, count, &count), "buffer is NULL");
    /* Exactly as large as needed, so that valgrind sees a byte too many. */
    n3p_path_pose *poses = malloc(count * sizeof *poses);
    EXPECT(n3p_plan_poses(plan, poses, count - 1, &count), N3P_BUFFER_TOO_SMALL, "room for");
    OK(n3p_plan_poses(plan, poses, count, &count));
    HOLDS(poses[0].x == START.x && poses[count - 1].y == GOAL.y);
    OK(n3p_plan_poses(plan, poses, SIZE_MAX, &count));
    free(poses);

    n3p_limits limits = n3p_limits_default();
    limits.steer_rate = NAN;
    BAD(n3p_plan_trajectory(plan, &limits, NULL, 0, &count), "steer_rate is NaN");
    EXPECT(n3p_plan_trajectory(plan, NULL, NULL, 0, &count), N3P_BUFFER_TOO_SMALL, "room");
    n3p_moment *moments = malloc(count * sizeof *moments);
    OK(n3p_plan_trajectory(plan, NULL, moments, count, &count));
    HOLDS(moments[count - 1].speed == 0.0 && moments[count - 1].time > 5.0);
    /* Other limits are heard, and nothing is left of those that cannot be used. */
    const double usual = moments[count - 1].time;
    const size_t usual_count = count;
    limits = n3p_limits_default();
    limits.forward_acceleration = limits.backward_acceleration = 4.0;
    OK(n3p_plan_trajectory(plan, &limits, moments, usual_count, &count));
    HOLDS(count < usual_count && moments[count - 1].time < usual);
    limits.forward_acceleration = -1.0;
    BAD(n3p_plan_trajectory(plan, &limits, moments, usual_count, &count), "acceleration is -1");
    OK(n3p_plan_trajectory(plan, NULL, moments, usual_count, &count));
    HOLDS(count == usual_count && moments[count - 1].time == usual);
    free(moments);

    size_t length = 0;
    EXPECT(n3p_plan_json(plan, NULL, 0, &length), N3P_BUFFER_TOO_SMALL, "room");
    char *json = malloc(length + 1);
    EXPECT(n3p_plan_json(plan, json, length, &length), N3P_BUFFER_TOO_SMALL, "room");
    OK(n3p_plan_json(plan, json, length + 1, &length));
    HOLDS(strlen(json) == length && json[0] == '{');
    free(json);

    OK(n3p_plan_free(plan));
    OK(n3p_lot_free(lot));
    OK(n3p_parker_free(parker));
}

static void scenes(void) {
    n3p_scene *scene = NULL;
    BAD(n3p_scene_read(NULL, &scene), "file is NULL");
    BAD(n3p_scene_read("nowhere.json", &scene), "nowhere.json: cannot read");
    BAD(n3p_scene_read("nowhere.txt", &scene), "expected .json");
    BAD(n3p_scene_from_json(NULL, 3, &scene), "json is NULL");
    BAD(n3p_scene_from_json("", 0, &scene), "json");
    BAD(n3p_scene_from_json("{\"start\": [NaN]}", 16, &scene), "NaN");
    BAD(n3p_scene_from_json("\xff", 1, &scene), "UTF-8");
    HOLDS(scene == NULL);
    const char *text = "{\"start\": [0, 0, 0], \"goal\": [5, 0, 0], \"obstacles\": [],"
                       " \"vehicle\": {\"length\": 4.5, \"width\": 1.8, \"wheelbase\": 2.7,"
                       " \"rear_overhang\": 0.9, \"max_steer\": 0.6}}";
    OK(n3p_scene_from_json(text, strlen(text), &scene));
    n3p_vehicle car;
    BAD(n3p_scene_vehicle(scene, NULL), "vehicle is NULL");
    OK(n3p_scene_vehicle(scene, &car));
    n3p_parker *parker = NULL;
    n3p_plan *plan = NULL;
    OK(n3p_parker_new(&car, NULL, &parker));
    OK(n3p_parker_plan_scene(parker, scene, &plan));
    OK(n3p_plan_free(plan));
    OK(n3p_parker_free(parker));
    car.width += 0.1;
    OK(n3p_parker_new(&car, NULL, &parker));
    BAD(n3p_parker_plan_scene(parker, scene, &plan), "vehicle");
    OK(n3p_parker_free(parker));
    OK(n3p_scene_free(scene));
    BAD(n3p_scene_free(scene), "scene is no open n3p_scene");
}

static void batches(void) {
    enum { COUNT = 6 };
    n3p_parker *parker = usual_parker();
    n3p_lot *lot = usual_lot();
    n3p_request requests[COUNT];
    const n3p_lot *lots[COUNT];
    n3p_plan *plans[COUNT];
    n3p_status statuses[COUNT];
    memset(requests, 0, sizeof requests);
    for (int i = 0; i < COUNT; i++) {
        requests[i].start = START;
        requests[i].start.x += 0.1 * i;
        requests[i].goals = &GOAL;
        requests[i].goal_count = 1;
        lots[i] = lot;
    }
    OK(n3p_parker_plan_batch(parker, requests, lots, COUNT, plans, NULL));
    for (int i = 0; i < COUNT; i++) {
        n3p_plan *alone = NULL;
        n3p_summary batched, single;
        OK(n3p_parker_plan_request(parker, &requests[i], lot, &alone));
        OK(n3p_plan_summary(alone, &single));
        OK(n3p_plan_summary(plans[i], &batched));
        HOLDS(single.length == batched.length);
        OK(n3p_plan_free(alone));
        OK(n3p_plan_free(plans[i]));
    }
    requests[3].start = (n3p_pose){2.0, 0.0, 0.0};
    BAD(n3p_parker_plan_batch(parker, requests, lots, COUNT, plans, statuses), "requests[3]: start");
    for (int i = 0; i < COUNT; i++) {
        HOLDS((plans[i] == NULL) == (i == 3));
        HOLDS(statuses[i] == (i == 3 ? N3P_BAD_INPUT : N3P_OK));
        OK(n3p_plan_free(plans[i]));
    }
    lots[2] = NULL;
    BAD(n3p_parker_plan_batch(parker, requests, lots, COUNT, plans, statuses), "lots[2] is NULL");
    HOLDS(plans[0] == NULL && statuses[5] == N3P_BAD_INPUT);
    lots[2] = lot;
    requests[1].goals = NULL;
    BAD(n3p_parker_plan_batch(parker, requests, lots, COUNT, plans, NULL), "requests[1]: goals");
    BAD(n3p_parker_plan_batch(parker, NULL, lots, COUNT, plans, NULL), "requests is NULL");
    BAD(n3p_parker_plan_batch(parker, requests, NULL, COUNT, plans, NULL), "lots is NULL");
    BAD(n3p_parker_plan_batch(parker, requests, lots, COUNT, NULL, NULL), "plans is NULL");
    BAD(n3p_parker_plan_batch(parker, requests, lots, SIZE_MAX, plans, NULL), "count");
    OK(n3p_parker_plan_batch(parker, NULL, NULL, 0, NULL, NULL));
    OK(n3p_lot_free(lot));
    OK(n3p_parker_free(parker));
}

/* What the threads share, and what they found. */
typedef struct {
    const n3p_parker *parker;
    n3p_lot *lot;
    double length;
    int fault;
} shared;

static void *plan_often(void *argument) {
    shared *own = argument;
    for (int i = 0; i < 50; i++) {
        n3p_plan *plan = NULL;
        n3p_summary summary;
        if (n3p_parker_plan(own->parker, START, GOAL, own->lot, &plan) ||
            n3p_plan_summary(plan, &summary) || n3p_plan_free(plan)) {
            own->fault = 1;
            return NULL;
        }
        own->length = summary.length;
    }
    /* A message of this thread alone. */
    own->fault = n3p_lot_polygon(NULL, NULL, 0) != N3P_BAD_INPUT || !*n3p_last_error();
    return NULL;
}

static void threads(void) {
    n3p_parker *parker = usual_parker();
    n3p_lot *lot = usual_lot();
    BAD(n3p_lot_clear(NULL), "lot is NULL");
    shared each[3];
    pthread_t threads[3];
    for (int i = 0; i < 3; i++) {
        each[i] = (shared){parker, lot, 0.0, 0};
        HOLDS(!pthread_create(&threads[i], NULL, plan_often, &each[i]));
    }
    /* Far away from all that is planned, while it is planned. */
    for (int i = 0; i < 50; i++) {
        const double point[] = {200.0 + i, 200.0};
        OK(n3p_lot_points(lot, point, 1));
    }
    for (int i = 0; i < 3; i++) {
        pthread_join(threads[i], NULL);
        HOLDS(!each[i].fault && each[i].length == each[0].length);
    }
    HOLDS(strstr(n3p_last_error(), "lot is NULL"));
    OK(n3p_lot_free(lot));
    OK(n3p_parker_free(parker));
}

int main(void) {
    HOLDS(!*n3p_last_error());
    HOLDS(*n3p_version());
    parkers();
    lots();
    closed();
    plans();
    buffers();
    scenes();
    batches();
    threads();
    if (faults == 0) {
        puts("misuse: all codes as expected");
    }
    return faults != 0;
}
