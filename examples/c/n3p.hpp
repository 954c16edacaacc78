// What a C++ program puts around n3p.h: handles that free themselves, and errors that are thrown.
#pragma once

#include <n3p.h>

#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace n3p {

// A call that did not return N3P_OK.
struct Error : std::runtime_error {
    explicit Error(n3p_status status) : std::runtime_error(n3p_last_error()), status(status) {}
    n3p_status status;
};

inline void check(n3p_status status) {
    if (status != N3P_OK) throw Error(status);
}

template <typename Handle, n3p_status (*Free)(Handle *)>
struct Deleter {
    void operator()(Handle *handle) const { (void)Free(handle); }
};

using Parker = std::unique_ptr<n3p_parker, Deleter<n3p_parker, n3p_parker_free>>;
using Lot = std::unique_ptr<n3p_lot, Deleter<n3p_lot, n3p_lot_free>>;
using Scene = std::unique_ptr<n3p_scene, Deleter<n3p_scene, n3p_scene_free>>;
using Plan = std::unique_ptr<n3p_plan, Deleter<n3p_plan, n3p_plan_free>>;

inline Parker make_parker(const n3p_vehicle &vehicle, const n3p_options *options = nullptr) {
    n3p_parker *parker = nullptr;
    check(n3p_parker_new(&vehicle, options, &parker));
    return Parker(parker);
}

inline Lot make_lot() {
    n3p_lot *lot = nullptr;
    check(n3p_lot_new(&lot));
    return Lot(lot);
}

inline Scene read_scene(const std::string &file) {
    n3p_scene *scene = nullptr;
    check(n3p_scene_read(file.c_str(), &scene));
    return Scene(scene);
}

inline n3p_vehicle vehicle_of(const Scene &scene) {
    n3p_vehicle vehicle;
    check(n3p_scene_vehicle(scene.get(), &vehicle));
    return vehicle;
}

inline Plan plan(const Parker &parker, n3p_pose start, n3p_pose goal, const Lot &lot) {
    n3p_plan *plan = nullptr;
    check(n3p_parker_plan(parker.get(), start, goal, lot.get(), &plan));
    return Plan(plan);
}

inline Plan plan(const Parker &parker, const Scene &scene) {
    n3p_plan *plan = nullptr;
    check(n3p_parker_plan_scene(parker.get(), scene.get(), &plan));
    return Plan(plan);
}

inline n3p_summary summary(const Plan &plan) {
    n3p_summary summary;
    check(n3p_plan_summary(plan.get(), &summary));
    return summary;
}

inline std::vector<n3p_path_pose> poses(const Plan &plan) {
    size_t count = 0;
    (void)n3p_plan_poses(plan.get(), nullptr, 0, &count);
    std::vector<n3p_path_pose> poses(count);
    check(n3p_plan_poses(plan.get(), poses.data(), poses.size(), &count));
    return poses;
}

inline std::string json(const Plan &plan) {
    size_t length = 0;
    (void)n3p_plan_json(plan.get(), nullptr, 0, &length);
    std::string text(length + 1, '\0');
    check(n3p_plan_json(plan.get(), text.data(), text.size(), &length));
    text.resize(length);
    return text;
}

}  // namespace n3p
