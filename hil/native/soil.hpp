// Forces of loose soil on a rolling wheel: 31 angles x 3 slices of the rim on the triangulated ground.
//
//   p      = max(0, k z^n u + c_d dz/dt)          pressure along the rim's inward normal, z depth below the surface,
//                                                 u < 1 on the half that trails (gives the compaction resistance)
//   dJ/dt  = v_slip - (rolling / L) J             shear displacement, along and across; L contact length. Rolling brings
//                                                 fresh soil; parked, nothing relaxes: the wheel holds
//   tau    = (c A + N tan phi) (1 - exp(-|J| / K))   Janosi, against J; damped by dJ/dt (which is 0 in steady rolling,
//                                                 so it costs no slip and a parked rover does not chatter)
// One resultant at the pressure centre. No allocation, no exceptions, no Python.
#pragma once
#include <algorithm>
#include <cmath>

#include "../../onboard/kernels/elementary.hpp"

namespace soil {

namespace elementary = eldorado::elementary;  // the same bits on every processor

struct Vec {
    double x = 0, y = 0, z = 0;
};
inline Vec operator+(Vec a, Vec b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Vec operator-(Vec a, Vec b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Vec operator*(double s, Vec a) { return {s * a.x, s * a.y, s * a.z}; }
inline double dot(Vec a, Vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vec cross(Vec a, Vec b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
inline Vec unit(Vec a) { return (1.0 / std::sqrt(dot(a, a))) * a; }

// Height on the mesh: squares cut from (x + 1, y) to (x, y + 1); off the mesh the height of the nearest edge.
struct Ground {
    const float* z;
    int rows, columns;
    double x0, y0, cell;

    double height(double x, double y) const {
        const double u0 = std::clamp((x - x0) / cell, 0.0, columns - 1.0);
        const double v0 = std::clamp((y - y0) / cell, 0.0, rows - 1.0);
        const int i = std::min(static_cast<int>(u0), columns - 2), j = std::min(static_cast<int>(v0), rows - 2);
        const double u = u0 - i, v = v0 - j;
        const float* at = z + static_cast<long>(j) * columns + i;
        const double z10 = at[1], z01 = at[columns];
        if (u + v <= 1) return at[0] + u * (z10 - at[0]) + v * (z01 - at[0]);
        const double z11 = at[columns + 1];
        return z11 + (1 - u) * (z01 - z11) + (1 - v) * (z10 - z11);
    }
};

struct Soil {  // one row of hil.plant.soil.CLASSES
    double stiffness, exponent, damping, unloading, cohesion, tan_phi, shear_length, shear_damping;
};

struct Wheel {  // state of the soil under one wheel
    double along = 0, across = 0;  // shear displacement, m
    double heading = 0;            // -1..1: trailing half; changes only while the wheel rolls, so it stays when parked
};

struct Motion {
    Vec centre, axis, velocity, spin;  // axis: unit, to the left
};

struct Contact {
    Vec force, point;
    double load = 0, sinkage = 0;
};

constexpr int ANGLES = 31, SLICES = 3;
constexpr double REACH = 50 * 3.14159265358979323846 / 180, STEP = 2 * REACH / (ANGLES - 1);
constexpr double TURN_OVER = 0.01;  // m of rolling until the trailing half has changed sides

inline Contact step(const Ground& ground, const Soil& soil, Wheel& wheel, const Motion& m, double radius, double width,
                    double dt) {
    Contact out;
    out.point = m.centre;
    const Vec ahead = unit(cross(m.axis, {0, 0, 1})), up = cross(ahead, m.axis);
    const double fore = ground.height(m.centre.x + 0.5 * radius * ahead.x, m.centre.y + 0.5 * radius * ahead.y);
    const double aft = ground.height(m.centre.x - 0.5 * radius * ahead.x, m.centre.y - 0.5 * radius * ahead.y);
    const double middle = elementary::atan2(fore - aft, radius);  // the rim's angle that looks at the ground
    const double piece = radius * STEP * width / SLICES;

    Vec push, moment;
    double sum = 0, area = 0, first = 10, last = -10;
    for (int k = 0; k < ANGLES; ++k) {
        const double angle = middle - REACH + k * STEP, sine = elementary::sin(angle), cosine = elementary::cos(angle);
        const Vec inward = cosine * up - sine * ahead;
        const double closing = -dot(m.velocity, inward);
        const double loaded = 1 - (1 - soil.unloading) * std::clamp(0.5 - wheel.heading * (angle - middle) / 0.2, 0.0, 1.0);
        for (int s = 0; s < SLICES; ++s) {
            const Vec at = m.centre + (width * ((s + 0.5) / SLICES - 0.5)) * m.axis - radius * inward;
            const double depth = ground.height(at.x, at.y) - at.z;
            if (depth <= 0) continue;
            const double still = soil.stiffness * (soil.exponent == 1 ? depth : elementary::exp(soil.exponent * elementary::log(depth))) * loaded;
            const double force = std::max(0.0, still + soil.damping * closing) * piece;
            push = push + force * inward;
            moment = moment + force * at;
            sum += force;
            area += piece;
            first = std::min(first, angle);
            last = std::max(last, angle);
            out.sinkage = std::max(out.sinkage, depth);
        }
    }
    const double way = dot(m.velocity, ahead), rim = dot(m.spin, m.axis) * radius;
    wheel.heading = std::clamp(wheel.heading + way * dt / TURN_OVER, -1.0, 1.0);
    if (sum <= 0) {
        wheel.along = wheel.across = 0;
        return out;
    }
    out.point = (1 / sum) * moment;
    out.load = std::sqrt(dot(push, push));
    const Vec normal = (1 / out.load) * push, along = unit(cross(m.axis, normal)), across = cross(normal, along);
    const Vec slip = m.velocity + cross(m.spin, -radius * normal);  // of the rim, not of the chord's centre
    const double length = radius * (last - first + STEP);
    const double fresh = std::max(std::fabs(rim), std::fabs(way)) / length;
    // Implicit in the relaxation: stable for any step.
    const double a1 = (wheel.along + dt * dot(slip, along)) / (1 + dt * fresh);
    const double b1 = (wheel.across + dt * dot(slip, across)) / (1 + dt * fresh);
    const double rate_a = (a1 - wheel.along) / dt, rate_b = (b1 - wheel.across) / dt;
    const double size = elementary::hypot(a1, b1), most = 6 * soil.shear_length, shrink = size > most ? most / size : 1;
    wheel.along = a1 * shrink;
    wheel.across = b1 * shrink;

    const double limit = soil.cohesion * area + out.load * soil.tan_phi;
    const double spring = size > 1e-12 ? limit * (1 - elementary::exp(-size / soil.shear_length)) / size : limit / soil.shear_length;
    double fa = -spring * a1 - soil.shear_damping * out.load * rate_a;
    double fb = -spring * b1 - soil.shear_damping * out.load * rate_b;
    const double total = elementary::hypot(fa, fb);
    if (total > limit) fa *= limit / total, fb *= limit / total;
    out.force = push + fa * along + fb * across;
    return out;
}

}  // namespace soil
