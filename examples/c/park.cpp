// Plans from polygons, asks for the path in time, and measures a parker and a warm plan.
#include "n3p.hpp"

#include <algorithm>
#include <chrono>
#include <cstdio>

// What `work` takes, microseconds: the median, since other programs disturb.
template <typename Work> double median(size_t runs, Work work) {
    std::vector<double> times;
    for (size_t i = 0; i < runs; i++) {
        const auto before = std::chrono::steady_clock::now();
        work();
        const auto after = std::chrono::steady_clock::now();
        times.push_back(std::chrono::duration<double, std::micro>(after - before).count());
    }
    std::nth_element(times.begin(), times.begin() + runs / 2, times.end());
    return times[runs / 2];
}

int main() try {
    // The first one of a program finds less prepared.
    const auto make = [] { n3p::make_parker(n3p_vehicle_default()); };
    const double first = median(1, make);
    std::printf("a parker: %.2f ms, the first one %.2f ms\n", median(50, make) / 1e3, first / 1e3);
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

    // A path for a car to follow: the steering angle does not jump while it drives.
    n3p_options options = {};
    options.standstill_steering = N3P_STEERING_AT_CHANGES;
    const n3p::Parker follower = n3p::make_parker(n3p_vehicle_default(), &options);
    const n3p::Plan smooth = n3p::plan(follower, start, goal, lot);
    std::vector<n3p_moment> moments(2000);
    size_t count = 0;
    n3p::check(n3p_plan_trajectory(smooth.get(), nullptr, moments.data(), moments.size(), &count));
    std::printf("%.1f s of driving in %zu moments\n", moments[count - 1].time, count);

    const double warm = median(2000, [&] { n3p::plan(parker, start, goal, lot); });
    std::printf("a warm plan: %.1f us\n", warm);

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
