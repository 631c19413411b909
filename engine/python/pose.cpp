#include "module.h"

#include <array>
#include <charconv>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include <ensonify/engine/base/units.h>

namespace ensonify::python {
namespace {

using Triple = std::array<double, 3>;

Triple triple(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }
Eigen::Vector3d vector(const Triple& t) { return {t[0], t[1], t[2]}; }

Pose make_pose(double x_m, double y_m, double z_m, double t_s, double roll_deg, double pitch_deg,
               double heading_deg, const Triple& velocity_mps, const Triple& rates_degps) {
  return {.t_s = t_s,
          .position = {x_m, y_m, z_m},
          .roll_rad = roll_deg * degree,
          .pitch_rad = pitch_deg * degree,
          .heading_rad = heading_deg * degree,
          .velocity_mps = vector(velocity_mps),
          .roll_rate_radps = rates_degps[0] * degree,
          .pitch_rate_radps = rates_degps[1] * degree,
          .heading_rate_radps = rates_degps[2] * degree};
}

Triple rates_degps(const Pose& pose) {
  return {pose.roll_rate_radps / degree, pose.pitch_rate_radps / degree,
          pose.heading_rate_radps / degree};
}

/// All numbers of a pose, for pickling and comparing.
using PoseNumbers = std::array<double, 13>;
PoseNumbers numbers_of(const Pose& pose) {
  const auto& [t, position, roll, pitch, heading, velocity, roll_rate, pitch_rate, heading_rate] =
      pose;
  const auto [x, y, z] = triple(position);
  const auto [east, north, up] = triple(velocity);
  return {t, x, y, z, roll, pitch, heading, east, north, up, roll_rate, pitch_rate, heading_rate};
}
Pose pose_of(const PoseNumbers& n) {
  return {n[0], {n[1], n[2], n[3]}, n[4], n[5], n[6], {n[7], n[8], n[9]}, n[10], n[11], n[12]};
}

template <int axis>
double coordinate_m(const Pose& pose) {
  return pose.position[axis];
}
template <int axis>
void set_coordinate(Pose& pose, double to_m) {
  pose.position[axis] = to_m;
}
template <double Pose::*angle_rad>
double angle_deg(const Pose& pose) {
  return pose.*angle_rad / degree;
}
template <double Pose::*angle_rad>
void set_angle(Pose& pose, double to_deg) {
  pose.*angle_rad = to_deg * degree;
}

/// The shortest number of degrees from which Pose makes this angle; or else the nearest number.
std::string degrees_text(double angle_rad) {
  const double nearest_deg = angle_rad / degree;
  for (int digits = 12; digits <= 17; ++digits)
    for (const double towards : {nearest_deg, -HUGE_VAL, HUGE_VAL}) {
      std::string text = fmt::format("{:.{}g}", std::nextafter(nearest_deg, towards), digits);
      double back_deg = 0.0;
      std::from_chars(text.data(), text.data() + text.size(), back_deg);
      if (back_deg * degree == angle_rad) return text;
    }
  return fmt::format("{}", nearest_deg);
}

/// The Python expression of a pose, without arguments that are 0.
std::string text_of(const Pose& pose) {
  const auto [x_m, y_m, z_m] = triple(pose.position);
  std::string text = fmt::format("Pose({}, {}, {}", x_m, y_m, z_m);
  if (pose.t_s != 0.0) text += fmt::format(", t_s={}", pose.t_s);
  for (const auto& [name, angle_rad] : {std::pair{"roll_deg", pose.roll_rad},
                                        {"pitch_deg", pose.pitch_rad},
                                        {"heading_deg", pose.heading_rad}})
    if (angle_rad != 0.0) text += fmt::format(", {}={}", name, degrees_text(angle_rad));
  if (const auto [east, north, up] = triple(pose.velocity_mps); !pose.velocity_mps.isZero(0.0))
    text += fmt::format(", velocity_mps=({}, {}, {})", east, north, up);
  if (rates_degps(pose) != Triple{})
    text += fmt::format(", rates_degps=({}, {}, {})", degrees_text(pose.roll_rate_radps),
                        degrees_text(pose.pitch_rate_radps), degrees_text(pose.heading_rate_radps));
  return text + ")";
}

}  // namespace

void add_pose(py::module_& module) {
  py::class_<Pose>(
      module, "Pose",
      R"(Pose(x_m, y_m, z_m, *, t_s=0.0, roll_deg=0.0, pitch_deg=0.0, heading_deg=0.0, velocity_mps=(0.0, 0.0, 0.0), rates_degps=(0.0, 0.0, 0.0))
--

Where a vehicle or an object is and how it is turned, at a time.

The world is in local metres: x east, y north, z up, and the sea surface is z = 0, so that 12 m deep
is z_m=-12. Heading turns clockwise from north, then pitch lifts the nose, then roll lowers the
starboard side; all in degrees. velocity_mps is the velocity (east, north, up) in m/s, and
rates_degps the rates of (roll, pitch, heading) in degrees per second; an echo is received on the
move. From north-east-down (NED) coordinates: x_m = east, y_m = north, z_m = -down, velocity_mps =
(v_east, v_north, -v_down); roll, pitch, heading and their rates are the same. Every argument is
also an attribute that can be set. Poses compare by value, and pickle.)")
      .def(py::init(&make_pose), py::arg("x_m"), py::arg("y_m"), py::arg("z_m"), py::kw_only(),
           py::arg("t_s") = 0.0, py::arg("roll_deg") = 0.0, py::arg("pitch_deg") = 0.0,
           py::arg("heading_deg") = 0.0, py::arg("velocity_mps") = Triple{},
           py::arg("rates_degps") = Triple{})
      .def_readwrite("t_s", &Pose::t_s, "Time, s.")
      .def_property("x_m", &coordinate_m<0>, &set_coordinate<0>, "East, local metres.")
      .def_property("y_m", &coordinate_m<1>, &set_coordinate<1>, "North, local metres.")
      .def_property("z_m", &coordinate_m<2>, &set_coordinate<2>,
                    "Up, metres; 0 at the sea surface, negative below.")
      .def_property(
          "position_m", [](const Pose& p) { return py::tuple(py::cast(triple(p.position))); },
          [](Pose& p, const Triple& to) { p.position = vector(to); }, "(x_m, y_m, z_m)")
      .def_property("roll_deg", &angle_deg<&Pose::roll_rad>, &set_angle<&Pose::roll_rad>,
                    "Degrees, starboard side down.")
      .def_property("pitch_deg", &angle_deg<&Pose::pitch_rad>, &set_angle<&Pose::pitch_rad>,
                    "Degrees, nose up.")
      .def_property("heading_deg", &angle_deg<&Pose::heading_rad>, &set_angle<&Pose::heading_rad>,
                    "Degrees, clockwise from north.")
      .def_property(
          "velocity_mps", [](const Pose& p) { return py::tuple(py::cast(triple(p.velocity_mps))); },
          [](Pose& p, const Triple& to) { p.velocity_mps = vector(to); },
          "Velocity (east, north, up), m/s.")
      .def_property(
          "rates_degps", [](const Pose& p) { return py::tuple(py::cast(rates_degps(p))); },
          [](Pose& p, const Triple& to) {
            p.roll_rate_radps = to[0] * degree;
            p.pitch_rate_radps = to[1] * degree;
            p.heading_rate_radps = to[2] * degree;
          },
          "Rates of (roll, pitch, heading), degrees per second.")
      .def("__repr__", &text_of)
      .def(
          "__eq__", [](const Pose& a, const Pose& b) { return numbers_of(a) == numbers_of(b); },
          py::is_operator(), py::arg("other"))
      .def(py::pickle(&numbers_of, &pose_of))
      // Python's own method works only for protocols from 2 on.
      .def("__reduce_ex__", [](const py::object& self, int) {
        return py::make_tuple(py::module_::import("copyreg").attr("__newobj__"),
                              py::make_tuple(py::type::of(self)),
                              numbers_of(self.cast<const Pose&>()));
      });
}

}  // namespace ensonify::python
