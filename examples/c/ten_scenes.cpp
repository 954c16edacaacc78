// Plans the scenes of a list and writes each path as n3p-plan --out does.
//
//   ten_scenes LIST FOLDER: LIST names a scene file a line; their paths go to FOLDER.
#include "n3p.hpp"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <fstream>

static std::string stem(const std::string &file) {
    const std::string name = file.substr(file.find_last_of('/') + 1);
    return name.substr(0, name.find_last_of('.'));
}

int main(int argc, char **argv) try {
    if (argc != 3) {
        std::fprintf(stderr, "usage: %s LIST FOLDER\n", argv[0]);
        return 2;
    }
    std::ifstream list(argv[1]);
    if (!list) throw std::runtime_error(std::string(argv[1]) + " cannot be read");
    for (std::string file; std::getline(list, file);) {
        const n3p::Scene scene = n3p::read_scene(file);
        const n3p::Parker parker = n3p::make_parker(n3p::vehicle_of(scene));
        const n3p::Plan plan = n3p::plan(parker, scene);
        const std::string out = std::string(argv[2]) + "/" + stem(file) + ".json";
        std::ofstream stream(out, std::ios::binary);
        stream << n3p::json(plan) << std::flush;
        if (!stream) throw std::runtime_error(out + " cannot be written");

        std::vector<double> times(101);
        for (double &time : times) {
            const auto before = std::chrono::steady_clock::now();
            const n3p::Plan again = n3p::plan(parker, scene);
            const auto after = std::chrono::steady_clock::now();
            time = std::chrono::duration<double, std::micro>(after - before).count();
        }
        std::nth_element(times.begin(), times.begin() + 50, times.end());
        std::printf("%-26s %6.2f m, a warm plan %8.1f us\n", stem(file).c_str(),
                    n3p::summary(plan).length, times[50]);
    }
    return 0;
} catch (const n3p::Error &error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    return error.status;
} catch (const std::exception &error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    return 1;
}
