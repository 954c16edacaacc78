/* The smallest program: one plan among two parked cars and a kerb.
 *
 *   gcc smallest.c $(pkg-config --cflags --libs n3p) -o smallest
 */
#include <n3p.h>
#include <stdio.h>

static int failed(void) {
    fprintf(stderr, "error: %s\n", n3p_last_error());
    return 1;
}

int main(void) {
    /* Metres; x and y of each corner in turn. */
    const double left[] = {-4.1, -2.6, -1.6, -2.6, -1.6, 2.4, -4.1, 2.4};
    const double right[] = {1.6, -2.6, 4.1, -2.6, 4.1, 2.4, 1.6, 2.4};
    const double kerb[] = {-15.0, 9.5, 15.0, 9.5};
    const n3p_pose start = {-9.0, 6.0, 0.0};
    const n3p_pose goal = {0.0, -1.4, 1.5707963267948966};

    const n3p_vehicle car = n3p_vehicle_default();
    n3p_parker *parker = NULL;
    n3p_lot *lot = NULL;
    n3p_plan *plan = NULL;
    if (n3p_parker_new(&car, NULL, &parker) || n3p_lot_new(&lot) ||
        n3p_lot_polygon(lot, left, 4) || n3p_lot_polygon(lot, right, 4) ||
        n3p_lot_polyline(lot, kerb, 2) || n3p_parker_plan(parker, start, goal, lot, &plan)) {
        return failed();
    }

    static n3p_path_pose poses[4096];
    size_t count = 0;
    if (n3p_plan_poses(plan, poses, 4096, &count)) {
        return failed();
    }
    for (size_t i = 0; i < count; i += 50) {
        printf("%6.2f m %6.2f m %6.3f rad, %s\n", poses[i].x, poses[i].y, poses[i].heading,
               poses[i].gear > 0 ? "forward" : "backward");
    }
    (void)n3p_plan_free(plan);
    (void)n3p_lot_free(lot);
    (void)n3p_parker_free(parker);
    return 0;
}
