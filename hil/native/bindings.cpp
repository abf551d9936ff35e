// Python bindings from pybullet's link states to the soil kernel: one call a physics step for all four wheels.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <vector>

#include "soil.hpp"

namespace nb = nanobind;
using Heights = nb::ndarray<const float, nb::shape<-1, -1>, nb::c_contig, nb::device::cpu>;

static soil::Vec vec(nb::handle row) {
    return {nb::cast<double>(row[0]), nb::cast<double>(row[1]), nb::cast<double>(row[2])};
}

static nb::tuple tuple(soil::Vec v) { return nb::make_tuple(v.x, v.y, v.z); }

// Left-pointing axis (0, 1, 0) of a link rotated by its quaternion x, y, z, w.
static soil::Vec axis(nb::handle q) {
    const double x = nb::cast<double>(q[0]), y = nb::cast<double>(q[1]), z = nb::cast<double>(q[2]), w = nb::cast<double>(q[3]);
    return {2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)};
}

struct Contacts {
    Heights heights;
    soil::Ground ground;
    double radius, width;
    std::vector<soil::Wheel> wheels;
    std::vector<soil::Soil> soils;

    Contacts(Heights z, double x0, double y0, double cell, double radius_m, double width_m, size_t count)
        : heights(z),
          ground{z.data(), static_cast<int>(z.shape(0)), static_cast<int>(z.shape(1)), x0, y0, cell},
          radius(radius_m), width(width_m), wheels(count), soils(count) {}

    void set_soil(size_t k, nb::tuple row) {
        auto at = [&](int i) { return nb::cast<double>(row[i]); };
        soils.at(k) = {at(0), at(1), at(2), at(3), at(4), at(5), at(6), at(7)};
    }

    void reset() { std::fill(wheels.begin(), wheels.end(), soil::Wheel{}); }

    nb::tuple state(size_t k) const {
        const auto& w = wheels.at(k);
        return nb::make_tuple(w.along, w.across, w.heading);
    }

    nb::list step(nb::tuple states, double dt) {
        nb::list out;
        for (size_t k = 0; k < wheels.size(); ++k) {
            nb::handle row = states[k];
            const soil::Motion motion{vec(row[0]), axis(row[1]), vec(row[6]), vec(row[7])};
            const auto c = soil::step(ground, soils[k], wheels[k], motion, radius, width, dt);
            out.append(nb::make_tuple(tuple(c.force), tuple(c.point), c.load, c.sinkage));
        }
        return out;
    }
};

NB_MODULE(_soil, m) {
    nb::class_<Contacts>(m, "Contacts")
        .def(nb::init<Heights, double, double, double, double, double, size_t>(), nb::arg("heights"), nb::arg("x0_m"),
             nb::arg("y0_m"), nb::arg("cell_m"), nb::arg("radius_m"), nb::arg("width_m"), nb::arg("wheels"))
        .def("set_soil", &Contacts::set_soil)
        .def("reset", &Contacts::reset)
        .def("state", &Contacts::state)
        .def("step", &Contacts::step);
}
