// Plans from polygons, asks for the path in time, and measures a warm plan.
#include "n3p.hpp"

#include <algorithm>
#include <chrono>
#include <cstdio>

int main() try {
    const n3p::Parker parker = n3p::make_parker(n3p_vehicle_default());

    // Two parked cars, a bay between them, and the kerb across the lane; metres.
    const n3p::Lot lot = n3p::make_lot();
    const std::vector<std::vector<double>> cars = {
        {-4.1, -2.6, -1.6, -2.6, -1.6, 2.4, -4.1, 2.4},
        {1.6, -2.6, 4.1, -2.6, 4.1, 2.4, 1.6, 2.4},
    };
    for (const auto &car : cars) n3p::check(n3p_lot_polygon(lot.get(), car.data(), car.size() / 2));
    const double kerb[] = {-15.0, 9.5, 15.0, 9.5};
    n3p::check(n3p_lot_polyline(lot.get(), kerb, 2));

    // Rear-axle poses: metres and radians.
    const n3p_pose start = {-9.0, 6.0, 0.0};
    const n3p_pose goal = {0.0, -1.4, 1.5707963267948966};
    const n3p::Plan plan = n3p::plan(parker, start, goal, lot);
    const n3p_summary summary = n3p::summary(plan);
    std::printf("%.2f m with %zu changes of direction by %s (%s)\n", summary.length,
                summary.direction_changes, summary.method, summary.route);
    std::printf("%zu poses\n", n3p::poses(plan).size());

    n3p_limits limits = n3p_limits_default();
    limits.stop_to_steer = 1;
    std::vector<n3p_moment> moments(1000);
    size_t count = 0;
    n3p::check(n3p_plan_trajectory(plan.get(), &limits, moments.data(), moments.size(), &count));
    std::printf("%.1f s of driving in %zu moments\n", moments[count - 1].time, count);

    // Once more, warm: the median, since other programs disturb.
    std::vector<double> times;
    for (int i = 0; i < 2000; i++) {
        const auto before = std::chrono::steady_clock::now();
        const n3p::Plan again = n3p::plan(parker, start, goal, lot);
        const auto after = std::chrono::steady_clock::now();
        times.push_back(std::chrono::duration<double, std::micro>(after - before).count());
    }
    std::nth_element(times.begin(), times.begin() + 1000, times.end());
    std::printf("a warm plan: %.1f us\n", times[1000]);

    // What cannot be planned is said in words.
    const n3p_pose within = {2.0, 0.0, 0.0};
    try {
        n3p::plan(parker, within, goal, lot);
    } catch (const n3p::Error &error) {
        std::printf("code %d: %s\n", error.status, error.what());
    }
    return 0;
} catch (const n3p::Error &error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    return error.status;
}
