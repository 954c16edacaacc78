/* Counts the allocations of a warm plan: malloc and its kin are replaced by those that count. Needs
 * glibc. Fails where a plan takes more than the argument, and where asking again takes any. */
#include <n3p.h>
#include <stdio.h>
#include <stdlib.h>

extern void *__libc_malloc(size_t);
extern void *__libc_calloc(size_t, size_t);
extern void *__libc_realloc(void *, size_t);
extern void *__libc_memalign(size_t, size_t);

static long count = 0;
static size_t bytes = 0;

void *malloc(size_t size) {
    count++;
    bytes += size;
    return __libc_malloc(size);
}

void *calloc(size_t number, size_t size) {
    count++;
    bytes += number * size;
    return __libc_calloc(number, size);
}

void *realloc(void *block, size_t size) {
    count++;
    bytes += size;
    return __libc_realloc(block, size);
}

int posix_memalign(void **block, size_t alignment, size_t size) {
    count++;
    bytes += size;
    *block = __libc_memalign(alignment, size);
    return *block == NULL;
}

int main(int argc, char **argv) {
    const long most = argc > 1 ? atol(argv[1]) : 1000000;
    const double left[] = {-4.1, -2.6, -1.6, -2.6, -1.6, 2.4, -4.1, 2.4};
    const double right[] = {1.6, -2.6, 4.1, -2.6, 4.1, 2.4, 1.6, 2.4};
    const double kerb[] = {-15.0, 9.5, 15.0, 9.5};
    const n3p_pose start = {-9.0, 6.0, 0.0}, goal = {0.0, -1.4, 1.5707963267948966};
    const n3p_vehicle car = n3p_vehicle_default();
    n3p_parker *parker = NULL;
    n3p_lot *lot = NULL;
    n3p_plan *plan = NULL;
    static n3p_path_pose poses[4096];
    static n3p_moment moments[4096];
    static char json[1 << 18];
    size_t number = 0;
    int failed = n3p_parker_new(&car, NULL, &parker) || n3p_lot_new(&lot) ||
                 n3p_lot_polygon(lot, left, 4) || n3p_lot_polygon(lot, right, 4) ||
                 n3p_lot_polyline(lot, kerb, 2);
    long planned = 0, read = 0, again = 0;
    size_t planned_bytes = 0;
    for (int i = 0; i < 10 && !failed; i++) {
        count = 0;
        bytes = 0;
        failed = n3p_parker_plan(parker, start, goal, lot, &plan);
        planned = count;
        planned_bytes = bytes;
        count = 0;
        failed = failed || n3p_plan_poses(plan, poses, 4096, &number);
        read = count;
        failed = failed || n3p_plan_json(plan, json, sizeof json, &number) ||
                 n3p_plan_trajectory(plan, NULL, moments, 4096, &number);
        count = 0;
        failed = failed || n3p_plan_poses(plan, poses, 4096, &number) ||
                 n3p_plan_json(plan, json, sizeof json, &number) ||
                 n3p_plan_trajectory(plan, NULL, moments, 4096, &number);
        again = count;
        failed = failed || n3p_plan_free(plan);
    }
    if (failed || n3p_lot_free(lot) || n3p_parker_free(parker)) {
        fprintf(stderr, "error: %s\n", n3p_last_error());
        return 1;
    }
    printf("a warm plan: %ld allocations, %zu bytes; its poses: %ld\n", planned, planned_bytes, read);
    if (planned + read > most) {
        fprintf(stderr, "expected at most %ld allocations\n", most);
        return 1;
    }
    if (again > 0) {
        fprintf(stderr, "poses, JSON and trajectory once more: %ld allocations\n", again);
        return 1;
    }
    return 0;
}
