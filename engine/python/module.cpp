// The Python module: what simulate.h and run.h offer, with NumPy arrays over the same memory.

#include <ensonify/engine/ping_all.h>
#include <ensonify/engine/scene/reader.h>
#include <ensonify/engine/session_keys.h>
#include <ensonify/engine/simulate.h>

#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
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

/// What a Python object is as a TOML value, tables on one line.
std::string toml_of(const py::handle& value) {
  if (py::isinstance<py::bool_>(value)) return value.cast<bool>() ? "true" : "false";
  if (py::isinstance<py::str>(value))
    return py::module_::import("json").attr("dumps")(value).cast<std::string>();
  std::string text;
  const auto append = [&](const std::string& item) { text += (text.empty() ? "" : ", ") + item; };
  if (py::isinstance<py::dict>(value)) {
    for (const auto& [key, item] : value.cast<py::dict>())
      append(fmt::format("{} = {}", toml_of(py::str(key)), toml_of(item)));
    return "{" + text + "}";
  }
  if (py::isinstance<py::list>(value) || py::isinstance<py::tuple>(value)) {
    for (const py::handle& item : value) append(toml_of(item));
    return "[" + text + "]";
  }
  if (py::isinstance<py::int_>(value) || py::isinstance<py::float_>(value))
    return py::repr(value).cast<std::string>();
  if (py::hasattr(value, "item")) return toml_of(value.attr("item")());  // NumPy's numbers
  if (py::hasattr(value, "__fspath__")) return toml_of(py::str(value.attr("__fspath__")()));
  throw py::type_error(fmt::format(
      "a scene holds no {}", py::str(py::type::of(value).attr("__name__")).cast<std::string>()));
}

/// Where a scene comes from, so that it can be read again with other values.
struct SceneSource {
  py::object given;  // a path or a dict
  std::vector<std::string> overrides;
  fs::path data;

  Scene read(const std::vector<std::string>& more = {}) const {
    std::vector<std::string> all = overrides;
    all.insert(all.end(), more.begin(), more.end());
    const fs::path data_folder = data.empty() ? environment_data() : data;
    if (!py::isinstance<py::dict>(given))
      return read_scene(given.cast<fs::path>(), all, data_folder);
    std::string text = given.contains("version") ? "" : "version = 1\n";
    for (const auto& [key, value] : given.cast<py::dict>())
      text += fmt::format("{} = {}\n", toml_of(py::str(key)), toml_of(value));
    return parse_scene(text, "the scene", all, {.scene_folder = ".", .data_folder = data_folder});
  }

  static fs::path environment_data() {
    const char* folder = std::getenv("ENSONIFY_DATA");
    return folder ? folder : "";
  }
};

std::vector<std::string> overrides_of(const py::dict& keys) {
  std::vector<std::string> all;
  for (const auto& [key, value] : keys)
    all.push_back(fmt::format("{}={}", py::str(key).cast<std::string>(), toml_of(value)));
  return all;
}

/// An array over a layer of what `owner` owns.
template <class T>
py::array array_of(const std::vector<T>& values, std::vector<py::ssize_t> shape,
                   const py::object& owner) {
  return py::array_t<T>(std::move(shape), values.data(), owner);
}

/// The layer of that name of a line or an image.
py::array layer_of(const py::object& self, const std::string& wanted, const Layers& layers,
                   const std::vector<py::ssize_t>& shape) {
  std::optional<py::array> found;
  std::string known;
  Layers::for_each([&](std::string_view name, auto layer) {
    if (name == wanted) found = array_of(layers.*layer, shape, self);
    known += fmt::format("{}{}", known.empty() ? "" : ", ", name);
  });
  if (!found)
    throw py::key_error(fmt::format("there is no layer '{}'; there are: {}", wanted, known));
  return *found;
}

std::vector<std::string> layer_names() {
  std::vector<std::string> names;
  Layers::for_each([&](std::string_view name, auto) { names.emplace_back(name); });
  return names;
}

/// A line that Python owns.
struct Line {
  std::string sonar;
  EchoLine line;
};

py::array layer_of_line(const py::object& self, const std::string& name) {
  const Layers& bins = self.cast<const Line&>().line.bins;
  return layer_of(self, name, bins, {static_cast<py::ssize_t>(bins.range_m.size())});
}

py::array layer_of_image(const py::object& self, const std::string& name) {
  const auto& image = self.cast<const Waterfall&>();
  return layer_of(
      self, name, image.pixels,
      {static_cast<py::ssize_t>(image.rows()), static_cast<py::ssize_t>(image.columns())});
}

Pose make_pose(double x_m, double y_m, double z_m, double t_s, double roll_deg, double pitch_deg,
               double heading_deg, const std::array<double, 3>& velocity_mps,
               const std::array<double, 3>& rates_degps) {
  constexpr double degree = std::numbers::pi / 180.0;
  return {.t_s = t_s,
          .position = {x_m, y_m, z_m},
          .roll_rad = roll_deg * degree,
          .pitch_rad = pitch_deg * degree,
          .heading_rad = heading_deg * degree,
          .velocity_mps = {velocity_mps[0], velocity_mps[1], velocity_mps[2]},
          .roll_rate_radps = rates_degps[0] * degree,
          .pitch_rate_radps = rates_degps[1] * degree,
          .heading_rate_radps = rates_degps[2] * degree};
}

fs::path cache_of(const std::optional<fs::path>& cache) { return cache ? *cache : default_cache(); }

/// A Simulator for Python's threads: one of them at a time is inside, without the interpreter's lock.
class Session {
 public:
  Session(py::object scene, const py::dict& keys, const fs::path& data,
          const std::optional<fs::path>& cache, int threads)
      : source_{std::move(scene), overrides_of(keys), data} {
    const Scene read = source_.read();
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
    return alone([&](Simulator& simulator) {
      if (number)
        simulator.ping(pose, *number);
      else
        simulator.ping(pose.t_s, pose);
      std::vector<EchoLine> lines = simulator.take_lines();
      std::vector<Line> owned;
      auto next = lines.begin();
      for (const Sonar& sonar : simulator.sonars())
        for (std::size_t i = 0; i < sides_of(sonar).size(); ++i)
          owned.push_back({sonar.name, std::move(*next++)});
      return owned;
    });
  }

  void set(const py::dict& keys) {
    for (const auto& [key, value] : keys)
      if (!py::str(key).cast<std::string>().starts_with("sonar."))
        throw py::value_error(
            fmt::format("'{}' cannot be set while the scene runs, expected a "
                        "sonar's key, as sonar.NAME.range_m",
                        py::str(key).cast<std::string>()));
    const std::vector<std::string> more = overrides_of(keys);
    const Scene changed = source_.read(more);
    alone([&](Simulator& simulator) {
      for (const std::size_t i : changed_sonars(changed, more))
        simulator.set_sonar(i, changed.sonars[i]);
    });
    source_.overrides.insert(source_.overrides.end(), more.begin(), more.end());
  }

  std::uint32_t add_mesh(
      const py::array_t<float, py::array::c_style | py::array::forcecast>& vertices,
      const py::array_t<std::uint32_t, py::array::c_style | py::array::forcecast>& faces,
      const Pose& pose, const std::string& material, const std::string& class_name) {
    const auto is_table = [](const py::array& array) {
      return array.ndim() == 2 && array.shape(1) == 3;
    };
    if (!is_table(vertices) || !is_table(faces))
      throw py::value_error(
          "vertices and faces have three columns: x, y, z in metres, and three vertices");
    MovingObject object;
    object.material = material;
    object.class_name = class_name;
    for (py::ssize_t i = 0; i < vertices.shape(0); ++i)
      object.mesh.positions.emplace_back(vertices.at(i, 0), vertices.at(i, 1), vertices.at(i, 2));
    for (py::ssize_t i = 0; i < faces.shape(0); ++i)
      object.mesh.faces.push_back({faces.at(i, 0), faces.at(i, 1), faces.at(i, 2)});
    return alone([&](Simulator& simulator) { return simulator.add(std::move(object), pose); });
  }

  std::uint32_t add(const py::dict& keys, const Pose& pose) {
    const SceneSource holder{py::dict(py::arg("objects") = py::make_tuple(keys)), {}, source_.data};
    MovingObject object = only_object(holder.read());
    return alone([&](Simulator& simulator) { return simulator.add(std::move(object), pose); });
  }

 private:
  SceneSource source_;
  std::unique_ptr<Simulator> simulator_;
  std::mutex mutex_;
};

/// A whole scene: an image a sonar, by name.
std::map<std::string, std::unique_ptr<Waterfall>> images(py::object given, const py::dict& keys,
                                                         const fs::path& data,
                                                         const std::optional<fs::path>& cache,
                                                         int threads, const py::object& progress) {
  const Scene scene = SceneSource{std::move(given), overrides_of(keys), data}.read();
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
  std::map<std::string, std::unique_ptr<Waterfall>> by_name;
  for (Waterfall& image : pings.images) {
    const std::string name = image.sonar.name;
    by_name[name] = std::make_unique<Waterfall>(std::move(image));
  }
  return by_name;
}

}  // namespace

PYBIND11_MODULE(_ensonify, module) {
  py::register_exception<SceneError>(module, "SceneError", PyExc_ValueError);
  py::register_exception<refine::MeshError>(module, "MeshError", PyExc_ValueError);
  module.attr("layers") = layer_names();

  py::class_<Pose>(module, "Pose")
      .def(py::init(&make_pose), py::arg("x_m"), py::arg("y_m"), py::arg("z_m"), py::kw_only(),
           py::arg("t_s") = 0.0, py::arg("roll_deg") = 0.0, py::arg("pitch_deg") = 0.0,
           py::arg("heading_deg") = 0.0, py::arg("velocity_mps") = std::array<double, 3>{},
           py::arg("rates_degps") = std::array<double, 3>{})
      .def_readwrite("t_s", &Pose::t_s)
      .def_property(
          "position_m",
          [](const Pose& pose) {
            return py::make_tuple(pose.position.x(), pose.position.y(), pose.position.z());
          },
          [](Pose& pose, const std::array<double, 3>& to) {
            pose.position = {to[0], to[1], to[2]};
          });

  py::class_<Line> line(module, "EchoLine");
  line.def_readonly("sonar", &Line::sonar)
      .def_property_readonly(
          "side",
          [](const Line& self) { return self.line.side == Side::port ? "port" : "starboard"; })
      .def_property_readonly("first_return",
                             [](const Line& self) { return self.line.first_return; })
      .def_property_readonly("starved", [](const Line& self) { return self.line.starved; })
      .def("__getitem__", &layer_of_line, py::arg("layer"));
  py::class_<Waterfall> image(module, "Image");
  image.def_property_readonly("sonar", [](const Waterfall& self) { return self.sonar.name; })
      .def_property_readonly(
          "shape",
          [](const Waterfall& self) { return py::make_tuple(self.rows(), self.columns()); })
      .def("__getitem__", &layer_of_image, py::arg("layer"));

  module.def("_images", &images, py::arg("scene"), py::arg("keys"), py::arg("data"),
             py::arg("cache"), py::arg("threads"), py::arg("progress"));

  py::class_<Session>(module, "Simulator")
      .def(py::init<py::object, const py::dict&, const fs::path&, const std::optional<fs::path>&,
                    int>(),
           py::arg("scene"), py::kw_only(), py::arg("keys") = py::dict(), py::arg("data") = "",
           py::arg("cache") = py::none(), py::arg("threads") = 0)
      .def("ping", &Session::ping, py::arg("pose"), py::arg("number") = py::none())
      .def("set", &Session::set, py::arg("keys"))
      .def("add", &Session::add, py::arg("object"), py::arg("pose"))
      .def("add_mesh", &Session::add_mesh, py::arg("vertices"), py::arg("faces"), py::arg("pose"),
           py::kw_only(), py::arg("material") = "steel", py::arg("class_name") = "object")
      .def(
          "move",
          [](Session& self, std::uint32_t instance, const Pose& pose) {
            self.alone([&](Simulator& simulator) { simulator.move(instance, pose); });
          },
          py::arg("instance"), py::arg("pose"))
      .def(
          "remove",
          [](Session& self, std::uint32_t instance) {
            self.alone([&](Simulator& simulator) { simulator.remove(instance); });
          },
          py::arg("instance"))
      .def(
          "altitude_m",
          [](Session& self, const Pose& pose) {
            return self.alone(
                [&](Simulator& simulator) { return simulator.altitude_m(pose.position); });
          },
          py::arg("pose"))
      .def("track",
           [](Session& self) {
             return self.alone([](Simulator& simulator) { return simulator.track(); });
           })
      .def_property_readonly("classes",
                             [](Session& self) {
                               return self.alone([](Simulator& s) {
                                 return std::vector<std::string>(s.classes().begin(),
                                                                 s.classes().end());
                               });
                             })
      .def_property_readonly("materials",
                             [](Session& self) {
                               return self.alone([](Simulator& s) {
                                 return std::vector<std::string>(s.materials().begin(),
                                                                 s.materials().end());
                               });
                             })
      .def_property_readonly("warnings", [](Session& self) {
        return self.alone([](Simulator& s) {
          return std::vector<std::string>(s.warnings().begin(), s.warnings().end());
        });
      });
}
