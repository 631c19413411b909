// The Python module: what simulate.h and run.h offer, with NumPy arrays over the same memory.

#include <ensonify/engine/output/attributes.h>
#include <ensonify/engine/output/manifest.h>
#include <ensonify/engine/output/targets_json.h>
#include <ensonify/engine/recording/recording_reader.h>
#include <ensonify/engine/scene/checks/extrapolation.h>
#include <ensonify/engine/scene/dump.h>
#include <ensonify/engine/scene/keys/key_text.h>
#include <ensonify/engine/session_keys.h>
#include <ensonify/engine/simulate.h>
#include <ensonify/engine/simulator/ping_all.h>
#include <ensonify/engine/units.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <fmt/format.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

namespace py = pybind11;
namespace fs = std::filesystem;
using namespace ensonify;
using namespace ensonify::engine;

namespace {

std::string type_name(const py::handle& value) {
  return py::str(py::type::of(value).attr("__name__")).cast<std::string>();
}

/// A mapping as a dict. Throws TypeError that names what holds it.
py::dict dict_of(const py::handle& value, std::string_view name) {
  if (value.is_none()) return {};
  if (!py::hasattr(value, "keys"))
    throw py::type_error(
        fmt::format("{} is a {}, expected a dict of a scene's keys", name, type_name(value)));
  return py::reinterpret_steal<py::dict>(
      py::module_::import("builtins").attr("dict")(value).release());
}

/// A Python string as UTF-8, which has no half of a surrogate pair. Throws ValueError for such.
std::string utf8_of(const py::handle& text) {
  py::ssize_t size = 0;
  const char* bytes = PyUnicode_AsUTF8AndSize(text.ptr(), &size);
  if (bytes) return {bytes, static_cast<std::size_t>(size)};
  PyErr_Clear();
  throw py::value_error(
      fmt::format("{} is no text: half of a surrogate pair is in it",
                  py::reinterpret_steal<py::str>(PyObject_ASCII(text.ptr())).cast<std::string>()));
}

constexpr int deepest = 100;  // of lists and dicts in each other; one that holds itself has no end

/// What a Python object is as a TOML value, tables on one line. `path` is its key. Throws
/// ValueError for a value that is too deep, TypeError for one that no scene holds.
std::string toml_of(const py::handle& value, const std::string& path, int depth = 0) {
  if (depth > deepest)
    throw py::value_error(fmt::format("'{}' has values more than {} deep in each other",
                                      path.substr(0, path.find('.')), deepest));
  if (py::isinstance<py::bool_>(value)) return value.cast<bool>() ? "true" : "false";
  if (py::isinstance<py::str>(value)) return toml_string(utf8_of(value));
  if (py::hasattr(value, "tolist"))  // NumPy's
    return toml_of(value.attr("tolist")(), path, depth + 1);
  std::string text;
  const auto append = [&](const std::string& item) { text += (text.empty() ? "" : ", ") + item; };
  if (py::hasattr(value, "keys")) {
    for (const auto& [key, item] : dict_of(value, path)) {
      const std::string name = utf8_of(py::str(key));
      append(fmt::format("{} = {}", toml_string(name),
                         toml_of(item, fmt::format("{}.{}", path, name), depth + 1)));
    }
    return "{" + text + "}";
  }
  if (py::isinstance<py::list>(value) || py::isinstance<py::tuple>(value)) {
    std::size_t i = 0;
    for (const py::handle& item : value)
      append(toml_of(item, fmt::format("{}.{}", path, i++), depth + 1));
    return "[" + text + "]";
  }
  if (py::isinstance<py::int_>(value)) {
    int overflow = 0;
    const long long number = PyLong_AsLongLongAndOverflow(value.ptr(), &overflow);
    if (overflow != 0)
      throw py::value_error(fmt::format("'{}' is {}, beyond the whole numbers of 64 bits", path,
                                        py::str(value).cast<std::string>()));
    return fmt::format("{}", number);
  }
  if (py::isinstance<py::float_>(value))
    return py::repr(py::float_(value.cast<double>())).cast<std::string>();
  if (py::hasattr(value, "__fspath__")) return toml_of(value.attr("__fspath__")(), path, depth + 1);
  throw py::type_error(fmt::format(
      "'{}': a scene holds no {}, expected True or False, a number, a string, a path, a list, a "
      "dict or a NumPy array{}",
      path, type_name(value), value.is_none() ? "; leave the key out for its default" : ""));
}

/// The keys of a mapping with their values as TOML. `name` stands for it in messages.
std::vector<KeyValue> key_values(const py::handle& keys, std::string_view name) {
  std::vector<KeyValue> all;
  for (const auto& [key, value] : dict_of(keys, name)) {
    std::string text = utf8_of(py::str(key));
    std::string toml = toml_of(value, text);
    all.push_back({std::move(text), std::move(toml)});
  }
  return all;
}

fs::path data_folder_of(const fs::path& data) {
  if (!data.empty()) return data;
  const char* folder = std::getenv("ENSONIFY_DATA");
  return folder ? folder : "";
}

/// The scene that a path or a mapping gives, with keys changed.
SessionScene scene_of(const py::object& given, const py::object& keys, const fs::path& data) {
  const fs::path data_folder = data_folder_of(data);
  std::vector<std::string> overrides;
  for (const auto& [key, value] : key_values(keys, "keys"))
    overrides.push_back(fmt::format("{}={}", key, value));
  if (py::hasattr(given, "keys")) {
    std::string text = given.contains("version") ? "" : "version = 1\n";
    for (const auto& [key, value] : key_values(given, "the scene"))
      text += fmt::format("{} = {}\n", toml_string(key), value);
    return SessionScene(std::move(text), "the scene", std::move(overrides),
                        {.scene_folder = ".", .data_folder = data_folder});
  }
  if (!py::isinstance<py::str>(given) && !py::hasattr(given, "__fspath__"))
    throw py::type_error(fmt::format(
        "the scene is a {}, expected a scene file's path or a dict of its keys", type_name(given)));
  return SessionScene::of_file(given.cast<fs::path>(), std::move(overrides), data_folder);
}

/// A table of three columns, each number as a T. `kinds` are the letters of NumPy's kinds that it
/// may have, and `what` says so. An empty list is a table without rows.
template <class T>
py::array_t<T> table_of(const py::object& given, std::string_view name, std::string_view kinds,
                        std::string_view what) {
  const auto array = py::array::ensure(given);
  const bool rows = array && array.size() > 0;
  if (!array || (rows && kinds.find(array.dtype().kind()) == kinds.npos))
    throw py::type_error(
        fmt::format("{} are {}, expected an array of {}", name,
                    array ? "of " + py::str(array.dtype()).cast<std::string>() : "no array", what));
  if (!rows) return py::array_t<T>(std::vector<py::ssize_t>{0, 3});
  if (array.ndim() != 2 || array.shape(1) != 3)
    throw py::value_error(fmt::format("{} have other than three columns of {}", name, what));
  return py::array_t<T, py::array::c_style | py::array::forcecast>(array);
}

/// An array over a layer of what `owner` owns.
template <class T>
py::array array_of(const std::vector<T>& values, std::vector<py::ssize_t> shape,
                   const py::object& owner) {
  return py::array_t<T>(std::move(shape), values.data(), owner);
}

/// The layer of that name of a line or an image.
py::array layer_of(const py::object& self, const std::string& wanted, const BinLayers& layers,
                   const std::vector<py::ssize_t>& shape) {
  std::optional<py::array> found;
  std::string known;
  BinLayers::for_each([&](std::string_view name, auto layer) {
    if (name == wanted) found = array_of(layers.*layer, shape, self);
    known += fmt::format("{}{}", known.empty() ? "" : ", ", name);
  });
  if (!found)
    throw py::key_error(fmt::format("there is no layer '{}'; there are: {}", wanted, known));
  return *found;
}

std::vector<std::string> layer_names() {
  std::vector<std::string> names;
  BinLayers::for_each([&](std::string_view name, auto) { names.emplace_back(name); });
  return names;
}

/// A line that Python owns.
struct Line {
  std::string sonar;
  EchoLine line;

  const char* side() const { return line.side == Side::port ? "port" : "starboard"; }
};

py::array layer_of_line(const py::object& self, const std::string& name) {
  const BinLayers& bins = self.cast<const Line&>().line.bins;
  return layer_of(self, name, bins, {static_cast<py::ssize_t>(bins.range_m.size())});
}

/// All pings of a sonar, with what the files of a run have in addition to the layers.
struct Image {
  Waterfall waterfall;
  std::vector<Attribute> attributes;
  std::string targets;  // as JSON
  std::vector<std::string> classes, materials;
};

py::array layer_of_image(const py::object& self, const std::string& name) {
  const Waterfall& image = self.cast<const Image&>().waterfall;
  return layer_of(
      self, name, image.pixels,
      {static_cast<py::ssize_t>(image.rows()), static_cast<py::ssize_t>(image.columns())});
}

/// A value of each ping, in a list.
template <class T>
std::vector<T> by_ping(const Image& image, T PingRow::*member) {
  std::vector<T> all;
  for (const PingRow& ping : image.waterfall.pings) all.push_back(ping.*member);
  return all;
}

py::dict attributes_of(const Image& image) {
  py::dict all;
  for (const Attribute& attribute : image.attributes)
    std::visit([&](const auto& value) { all[attribute.name.c_str()] = value; }, attribute.value);
  return all;
}

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

/// All numbers of a pose, to pickle and to compare it.
using PoseNumbers = std::array<double, 13>;
PoseNumbers numbers_of(const Pose& p) {
  return {p.t_s,
          p.position.x(),
          p.position.y(),
          p.position.z(),
          p.roll_rad,
          p.pitch_rad,
          p.heading_rad,
          p.velocity_mps.x(),
          p.velocity_mps.y(),
          p.velocity_mps.z(),
          p.roll_rate_radps,
          p.pitch_rate_radps,
          p.heading_rate_radps};
}
Pose pose_of(const PoseNumbers& n) {
  return {.t_s = n[0],
          .position = {n[1], n[2], n[3]},
          .roll_rad = n[4],
          .pitch_rad = n[5],
          .heading_rad = n[6],
          .velocity_mps = {n[7], n[8], n[9]},
          .roll_rate_radps = n[10],
          .pitch_rate_radps = n[11],
          .heading_rate_radps = n[12]};
}

/// As it would be written, without what is 0.
std::string text_of(const Pose& pose) {
  // Twelve digits hide the rounding between degrees and radians.
  const auto joined = [](const Triple& t) {
    return fmt::format("{:.12g}, {:.12g}, {:.12g}", t[0], t[1], t[2]);
  };
  std::string text = "Pose(" + joined(triple(pose.position));
  for (const auto& [name, value] : {std::pair{"t_s", pose.t_s},
                                    {"roll_deg", pose.roll_rad / degree},
                                    {"pitch_deg", pose.pitch_rad / degree},
                                    {"heading_deg", pose.heading_rad / degree}})
    if (value != 0.0) text += fmt::format(", {}={:.12g}", name, value);
  for (const auto& [name, value] :
       {std::pair{"velocity_mps", triple(pose.velocity_mps)}, {"rates_degps", rates_degps(pose)}})
    if (value != Triple{}) text += fmt::format(", {}=({})", name, joined(value));
  return text + ")";
}

fs::path cache_of(const std::optional<fs::path>& cache) { return cache ? *cache : default_cache(); }

/// A Simulator for Python's threads: one of them at a time is inside, without the interpreter's
/// lock.
class Session {
 public:
  Session(const py::object& scene, const py::object& keys, const fs::path& data,
          const std::optional<fs::path>& cache, int threads)
      : source_(scene_of(scene, keys, data)) {
    const Scene read = source_.with();
    materials_ = read.materials;
    const py::gil_scoped_release unlocked;
    simulator_ = std::make_unique<Simulator>(
        read, Preparation{.cache = cache_of(cache), .threads = threads, .progress = [](auto) {
                            const py::gil_scoped_acquire locked;
                            if (PyErr_CheckSignals() != 0) throw py::error_already_set();
                          }});
  }

  /// Calls f(simulator) with no other thread inside, and the interpreter free.
  template <class F>
  auto alone(F&& f) {
    const py::gil_scoped_release unlocked;
    const std::lock_guard guard(mutex_);
    return f(*simulator_);
  }

  std::vector<Line> ping(const Pose& pose, std::optional<std::uint64_t> number) {
    std::string warning;
    std::vector<Line> lines = alone([&](Simulator& simulator) {
      const std::size_t warnings = simulator.warnings().size();
      if (number)
        simulator.ping_numbered(pose, *number);
      else
        simulator.ping(pose);
      if (simulator.warnings().size() > warnings) warning = simulator.warnings().back();
      std::vector<EchoLine> lines = simulator.take_lines();
      std::vector<Line> owned;
      auto next = lines.begin();
      for (const Sonar& sonar : simulator.sonars())
        for (int i = 0; i < static_cast<int>(sides_of(sonar).size()) * sonar.beams; ++i)
          owned.push_back({sonar.name, std::move(*next++)});
      return owned;
    });
    if (!warning.empty() && PyErr_WarnEx(PyExc_UserWarning, warning.c_str(), 1) != 0)
      throw py::error_already_set();
    return lines;
  }

  void set(const py::object& keys) {
    const std::vector<KeyValue> changes = key_values(keys, "keys");
    alone([&](Simulator& simulator) { set_sonars(simulator, source_, changes); });
  }

  std::vector<std::string> warnings() {
    return alone([&](Simulator& simulator) {
      return Extrapolation(simulator.sonars(), simulator.materials(), materials_)
          .behind(simulator.warnings());
    });
  }

  std::uint32_t add_mesh(const py::object& vertices, const py::object& faces, const Pose& pose,
                         const std::string& material, const std::string& class_name) {
    MovingObject object;
    object.material = material;
    object.class_name = class_name;
    const auto places = table_of<float>(vertices, "vertices", "fiu", "real numbers, in metres");
    for (py::ssize_t i = 0; i < places.shape(0); ++i)
      object.mesh.positions.emplace_back(places.at(i, 0), places.at(i, 1), places.at(i, 2));
    // A signed number of 64 bits, in which one that is too large for a vertex stays so.
    const auto corners = table_of<std::int64_t>(faces, "faces", "iu", "whole numbers, of vertices");
    for (py::ssize_t i = 0; i < corners.shape(0); ++i) {
      refine::Face& face = object.mesh.faces.emplace_back();
      for (py::ssize_t k = 0; k < 3; ++k) {
        const std::int64_t corner = corners.at(i, k);
        if (corner < 0 || corner >= places.shape(0))
          throw refine::MeshError(fmt::format("face {} has vertex {}, but the mesh has {} vertices",
                                              i, corner, places.shape(0)));
        face[static_cast<std::size_t>(k)] = static_cast<std::uint32_t>(corner);
      }
    }
    return alone([&](Simulator& simulator) { return simulator.add(std::move(object), pose); });
  }

  std::uint32_t add(const py::object& keys, const Pose& pose) {
    MovingObject object =
        object_of(key_values(keys, "the object"), "the object", {".", source_.paths().data_folder});
    return alone([&](Simulator& simulator) { return simulator.add(std::move(object), pose); });
  }

 private:
  SessionScene source_;              // under mutex_, once there is a simulator
  std::vector<Material> materials_;  // the scene's own
  std::unique_ptr<Simulator> simulator_;
  std::mutex mutex_;
};

/// A whole scene: an image of each sonar, by name, in the scene's order.
py::dict images(const py::object& given, const py::object& keys, const fs::path& data,
                const std::optional<fs::path>& cache, int threads, const py::object& progress) {
  const Scene scene = scene_of(given, keys, data).with();
  std::vector<std::unique_ptr<Image>> made;
  {
    const py::gil_scoped_release unlocked;
    const auto tell = [&](std::string_view stage, std::size_t done, std::size_t of) {
      const py::gil_scoped_acquire locked;
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
      if (!progress.is_none()) progress(std::string(stage), done, of);
    };
    Simulator simulator(scene, {.cache = cache_of(cache),
                                .threads = threads,
                                .progress = [&](auto stage) { tell(stage, 0, 1); }});
    ScenePings pings =
        ping_all(scene, simulator, threads,
                 [&](auto, std::size_t done, std::size_t of) { tell("pings", done, of); });
    const Seafloor& seafloor = simulator.seafloor();
    const LabelNames names =
        renumber({seafloor.classes, seafloor.materials},
                 {scene.output.class_names, scene.output.sediment_names}, pings.images);
    const ImageOrigin origin{seafloor.mesh.world_origin, xxh128(dump_scene(scene, false)), names};
    for (std::size_t i = 0; i < pings.images.size(); ++i) {
      Waterfall& waterfall = pings.images[i];
      std::vector<Attribute> attributes = image_attributes(waterfall, origin);
      std::string targets = targets_json(
          target_records(waterfall, seafloor, pings.object_visibility[i]), waterfall, seafloor);
      made.push_back(std::make_unique<Image>(std::move(waterfall), std::move(attributes),
                                             std::move(targets), names.classes, names.materials));
    }
  }
  py::dict by_name;
  for (std::unique_ptr<Image>& image : made) {
    const std::string name = image->waterfall.sonar.name;
    by_name[name.c_str()] = std::move(image);
  }
  return by_name;
}

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
      .def_property(
          "x_m", [](const Pose& p) { return p.position.x(); },
          [](Pose& p, double to) { p.position.x() = to; }, "East, local metres.")
      .def_property(
          "y_m", [](const Pose& p) { return p.position.y(); },
          [](Pose& p, double to) { p.position.y() = to; }, "North, local metres.")
      .def_property(
          "z_m", [](const Pose& p) { return p.position.z(); },
          [](Pose& p, double to) { p.position.z() = to; },
          "Up, metres; 0 at the sea surface, negative below.")
      .def_property(
          "position_m", [](const Pose& p) { return py::tuple(py::cast(triple(p.position))); },
          [](Pose& p, const Triple& to) { p.position = vector(to); }, "(x_m, y_m, z_m)")
      .def_property(
          "roll_deg", [](const Pose& p) { return p.roll_rad / degree; },
          [](Pose& p, double to) { p.roll_rad = to * degree; }, "Degrees, starboard side down.")
      .def_property(
          "pitch_deg", [](const Pose& p) { return p.pitch_rad / degree; },
          [](Pose& p, double to) { p.pitch_rad = to * degree; }, "Degrees, nose up.")
      .def_property(
          "heading_deg", [](const Pose& p) { return p.heading_rad / degree; },
          [](Pose& p, double to) { p.heading_rad = to * degree; }, "Degrees, clockwise from north.")
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
      .def(py::pickle(&numbers_of, &pose_of));
}

void add_results(py::module_& module) {
  py::class_<Line>(module, "EchoLine", R"(One side of one ping of a sonar, or one of its beams.

line["intensity"] is a layer of it: a NumPy array of (bins,), from near to far, over the line's own
memory, float32 or uint32. `layers` lists the names.)")
      .def_readonly("sonar", &Line::sonar, "The sonar's name.")
      .def_property_readonly("side", &Line::side, "\"port\" or \"starboard\".")
      .def_property_readonly(
          "beam", [](const Line& self) { return self.line.beam; },
          "The number of the beam, from 0 at the array's rear end.")
      .def_property_readonly(
          "first_return", [](const Line& self) { return self.line.first_return; },
          "The bin of the first echo of the bed or an object; -1 if there is none.")
      .def_property_readonly(
          "starved", [](const Line& self) { return self.line.starved; },
          "How many bins no ray reached.")
      .def("__getitem__", &layer_of_line, py::arg("layer"), R"(__getitem__(self, layer)
--

A layer, (bins,). Raises KeyError for a name that is no layer's.)")
      .def("__repr__", [](const Line& self) {
        return fmt::format("<EchoLine of {}, {}, {} bins>", self.sonar, self.side(),
                           self.line.bins.range_m.size());
      });

  py::class_<Image>(module, "Image", R"(All pings of a sonar.

image["intensity"] is a layer of it: a NumPy array of (pings, samples) over the image's own memory,
float32 or uint32. The oldest ping is row 0. Columns are port from far to near, then starboard from
near to far. `layers` lists the names.)")
      .def_property_readonly(
          "sonar", [](const Image& self) { return self.waterfall.sonar.name; }, "The sonar's name.")
      .def_property_readonly(
          "shape",
          [](const Image& self) {
            return py::make_tuple(self.waterfall.rows(), self.waterfall.columns());
          },
          "(pings, samples)")
      .def_property_readonly(
          "poses", [](const Image& self) { return by_ping(self, &PingRow::pose); },
          "The vehicle's true Pose at each ping.")
      .def_property_readonly(
          "reported_poses", [](const Image& self) { return by_ping(self, &PingRow::reported); },
          "What the vehicle's navigation takes its Pose for at each ping.")
      .def_property_readonly(
          "altitude_m",
          [](const Image& self) {
            const std::vector<double> all = by_ping(self, &PingRow::altitude_m);
            return py::array_t<double>(static_cast<py::ssize_t>(all.size()), all.data());
          },
          "The vehicle's height over the bed at each ping, metres, (pings,); NaN over a hole.")
      .def_property_readonly(
          "targets",
          [](const Image& self) -> py::object {
            return py::dict(py::module_::import("json").attr("loads")(self.targets))["targets"];
          },
          R"(The objects and features in the image, a list of dicts, as in a run's NAME_targets.json.

Boxes and outlines are in pixels of the picture, whose row 0 is the newest ping: row r there is row
pings - 1 - r here.)")
      .def_property_readonly(
          "attributes", &attributes_of,
          R"(What a run's files have in addition to the layers, a dict: frequency_hz, range_m,
bins, world_origin_x_m (and _y_m, _z_m), scene_hash, units_LAYER for each layer ...)")
      .def_property_readonly(
          "classes", [](const Image& self) { return self.classes; },
          "What the numbers of the layer `class` mean.")
      .def_property_readonly(
          "materials", [](const Image& self) { return self.materials; },
          "What the numbers of the layer `sediment` mean.")
      .def("__getitem__", &layer_of_image, py::arg("layer"), R"(__getitem__(self, layer)
--

A layer, (pings, samples). Raises KeyError for a name that is no layer's.)")
      .def("__repr__", [](const Image& self) {
        return fmt::format("<Image of {}, {} pings of {} samples>", self.waterfall.sonar.name,
                           self.waterfall.rows(), self.waterfall.columns());
      });
}

/// A side's samples over the line's own memory; None without them.
py::object samples_of(const py::object& self, Side side) {
  const auto& line = self.cast<const RecordedLine&>();
  const std::vector<float>& samples = line.side(side);
  if (samples.empty()) return py::none();
  return py::array_t<float>({line.pings.size(), line.samples}, samples.data(), self);
}

void add_recordings(py::module_& module) {
  py::class_<RecordedLine> line(
      module, "RecordedLine",
      R"(The pings of one sonar of a recording, or of one of its frequencies.

Numbers are NumPy arrays with one value per ping, (pings,): metres, degrees, seconds; NaN where the
file does not state them.)");
  line.def_readonly("format", &RecordedLine::format, "\"XTF\" or \"JSF\".")
      .def_readonly("sonar", &RecordedLine::sonar, "The sonar's name in the file, or \"\".")
      .def_readonly("frequency_hz", &RecordedLine::frequency_hz, "Hertz; 0 if not stated.")
      .def_readonly("bandwidth_hz", &RecordedLine::bandwidth_hz, "Hertz; 0 if not stated.")
      .def_readonly("pulse_length_s", &RecordedLine::pulse_length_s, "Seconds; 0 if not stated.")
      .def_readonly("sound_speed_mps", &RecordedLine::sound_speed_mps,
                    "Metres per second; 0 if not stated.")
      .def_readonly("warnings", &RecordedLine::warnings, "What was left out, a list of str.")
      .def_property_readonly(
          "port", [](const py::object& self) { return samples_of(self, Side::port); },
          "Amplitudes as recorded, (pings, samples), float32, near to far; None without this side.")
      .def_property_readonly(
          "starboard", [](const py::object& self) { return samples_of(self, Side::starboard); },
          "The same of the other side.")
      .def("__repr__", [](const RecordedLine& self) {
        return fmt::format("<RecordedLine of {} pings of {} samples>", self.pings.size(),
                           self.samples);
      });
  line.def_property_readonly(
      "number",
      [](const RecordedLine& self) {
        py::array_t<std::uint64_t> all(static_cast<py::ssize_t>(self.pings.size()));
        std::ranges::transform(self.pings, all.mutable_data(), &RecordedPing::number);
        return all;
      },
      "The pings' numbers; a lost ping leaves a gap.");
  for (const PingColumn& column : ping_columns())
    line.def_property_readonly(
        std::string(column.name).c_str(),
        [value = column.value](const RecordedLine& self) {
          py::array_t<double> all(static_cast<py::ssize_t>(self.pings.size()));
          std::ranges::transform(self.pings, all.mutable_data(), [&](const RecordedPing& ping) {
            return value(ping).value_or(std::numeric_limits<double>::quiet_NaN());
          });
          return all;
        },
        std::string(column.help).c_str());
  module.def(
      "read_recording",
      [](const fs::path& file) {
        const py::gil_scoped_release free;
        return read_recording(file);
      },
      py::arg("file"), R"(read_recording(file)
--

Reads the sidescan channels of an XTF or JSF recording: a list of a RecordedLine for each sonar or
frequency, at least one. Damaged packets are left out, with a warning. Raises RecordingError (a
ValueError) for a file that cannot be read, has another format, or has no sidescan samples.)");
}

std::vector<std::string> copied(std::span<const std::string> names) {
  return {names.begin(), names.end()};
}

void add_simulator(py::module_& module) {
  py::class_<Session>(module, "Simulator",
                      R"(Simulator(scene, *, keys=None, data='', cache=None, threads=0)
--

A scene made ready, to be pinged from any pose.

scene: a scene file's path, or a dict of the same keys. keys: changes to it, as
{"sea.temperature_c": 4}. data: the folder of `data:` paths (default: ENSONIFY_DATA). cache: the
folder for analysed seafloors (default: ~/.cache/ensonify). threads: how many make the scene ready
(0: one per core).

Any thread may call it; one is inside at a time, and others wait. The interpreter is free
meanwhile. Raises SceneError or MeshError (both ValueErrors) for what is wrong with the scene or
its files, ValueError for a wrong number of threads, TypeError for a value that no scene holds.)")
      .def(py::init<const py::object&, const py::object&, const fs::path&,
                    const std::optional<fs::path>&, int>(),
           py::arg("scene"), py::kw_only(), py::arg("keys") = py::none(), py::arg("data") = "",
           py::arg("cache") = py::none(), py::arg("threads") = 0)
      .def("ping", &Session::ping, py::arg("pose"), py::arg("number") = py::none(),
           R"(ping(self, pose, number=None)
--

One ping of every sonar, the vehicle being at a pose, sent at pose.t_s.

Returns a list of EchoLines: the sides of the first sonar (port, then starboard, of those it has),
then of the next. `number` selects the random numbers: the same number and pose give the same ping
again. Without one it is the session's next, from 0. Raises ValueError for a pose that is not
finite, that lies beyond 1e8 m, that turns faster than a million degrees per second, that puts a
sonar above the sea surface (z_m >= 0) or below the bed, or that is as fast as sound. Warns, once,
of a pose out of reach of the seafloor.)")
      .def("set", &Session::set, py::arg("keys"), R"(set(self, keys)
--

Changes sonars' keys from the next ping on, as {"sonar.sidescan.range_m": 40}.

Raises SceneError (a ValueError) for another key, or a value that a scene refuses; then nothing is
changed.)")
      .def("add", &Session::add, py::arg("object"), py::arg("pose"), R"(add(self, object, pose)
--

Puts an object into the scene, and returns its instance number.

object: a dict of the keys of a scene's [[objects]], as {"shape": "barrel"}. The pose places the
middle of its bounds: z up, y where the heading points. Raises SceneError for wrong keys, ValueError
for a pose that is not finite or lies beyond 1e8 m.)")
      .def("add_mesh", &Session::add_mesh, py::arg("vertices"), py::arg("faces"), py::arg("pose"),
           py::kw_only(), py::arg("material") = "fouled steel", py::arg("class_name") = "object",
           R"(add_mesh(self, vertices, faces, pose, *, material='fouled steel', class_name='object')
--

Puts a mesh into the scene, and returns its instance number.

vertices: (n, 3) metres, z up, y where the pose's heading points. faces: (m, 3) numbers of vertices.
Both sides of a face scatter. Raises ValueError for other shapes or an unknown material, TypeError
for faces of other than whole numbers or vertices of other than real ones, MeshError for a vertex
that is not there, not finite or beyond 1e8 m.)")
      .def(
          "move",
          [](Session& self, std::uint32_t instance, const Pose& pose) {
            self.alone([&](Simulator& simulator) { simulator.move(instance, pose); });
          },
          py::arg("instance"), py::arg("pose"), R"(move(self, instance, pose)
--

Moves an object that was added; the scene's own are fixed. Raises ValueError for an instance that is
not there.)")
      .def(
          "remove",
          [](Session& self, std::uint32_t instance) {
            self.alone([&](Simulator& simulator) { simulator.remove(instance); });
          },
          py::arg("instance"), R"(remove(self, instance)
--

Removes an object that was added. Raises ValueError for an instance that is not there.)")
      .def(
          "altitude_m",
          [](Session& self, const Pose& pose) {
            return self.alone(
                [&](Simulator& simulator) { return simulator.altitude_m(pose.position); });
          },
          py::arg("pose"), R"(altitude_m(self, pose)
--

The height over the bed straight below a pose, metres; objects are looked through. Negative below
the bed, NaN over a hole and off the seafloor.)")
      .def(
          "track",
          [](Session& self) {
            return self.alone([](Simulator& simulator) { return simulator.track(); });
          },
          R"(track(self)
--

The vehicle's Pose at each ping of the scene's own track, a list. Raises SceneError for a track that
leaves the seafloor or the water.)")
      .def_property_readonly(
          "classes",
          [](Session& self) {
            return self.alone([](Simulator& s) { return copied(s.classes()); });
          },
          "What the numbers of the layer `class` mean.")
      .def_property_readonly(
          "materials",
          [](Session& self) {
            return self.alone([](Simulator& s) { return copied(s.materials()); });
          },
          "What the numbers of the layer `sediment` mean.")
      .def_property_readonly(
          "warnings", &Session::warnings,
          "What should be known of the scene: repairs of meshes, models outside their range.");
}

/// The exceptions. Those of C++ that have no class here become an Error.
void add_exceptions(py::module_& module) {
  const auto doc = [](auto& exception, const char* text) { exception.doc() = text; };
  auto& base = py::register_exception<Error>(module, "Error", PyExc_Exception);
  doc(base, "The base of the exceptions of this module.");
  const auto and_base = [&](PyObject* other) {
    return py::make_tuple(py::handle(base), py::handle(other));
  };
  doc(py::register_exception<SceneError>(module, "SceneError", and_base(PyExc_ValueError)),
      "Something is wrong with a scene or a file it names.");
  doc(py::register_exception<RecordingError>(module, "RecordingError", and_base(PyExc_ValueError)),
      "Something is wrong with a recording.");
  doc(py::register_exception<refine::MeshError>(module, "MeshError", and_base(PyExc_ValueError)),
      "Something is wrong with a mesh.");
  doc(py::register_exception<engine::MemoryError>(module, "MemoryError",
                                                  and_base(PyExc_MemoryError)),
      "A scene does not fit into memory: what needs how much, the limit and the cure.");
}

}  // namespace

PYBIND11_MODULE(_ensonify, module) {
  py::options options;
  options.disable_function_signatures();  // the docstrings have Python's own
  add_exceptions(module);
  module.attr("layers") = layer_names();
  module.attr("__version__") = program_version();
  add_pose(module);
  add_results(module);
  add_simulator(module);
  add_recordings(module);
  module.def("images", &images, py::arg("scene"), py::kw_only(), py::arg("keys") = py::none(),
             py::arg("data") = "", py::arg("cache") = py::none(), py::arg("threads") = 0,
             py::arg("progress") = py::none(),
             R"(images(scene, *, keys=None, data='', cache=None, threads=0, progress=None)
--

Every ping of a scene: a dict of an Image of each sonar, by name, in the scene's order.

scene: a scene file's path, or a dict of the same keys. keys: changes, as {"track.altitude_m": 4}.
data: the folder of `data:` paths (default: ENSONIFY_DATA). cache: the folder for analysed seafloors
(default: ~/.cache/ensonify). threads: 0 for one per core. progress(stage, done, of) is
called now and then, and what it raises ends the work, as does Ctrl-C.

Raises SceneError or MeshError (both ValueErrors) for what is wrong with the scene or its files,
ValueError for a wrong number of threads, TypeError for a value that no scene holds.)");
}
