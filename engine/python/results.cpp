#include "module.h"

#include <memory>
#include <utility>
#include <variant>

#include <fmt/format.h>

#include <ensonify/engine/output/attributes.h>
#include <ensonify/engine/output/manifest.h>
#include <ensonify/engine/output/targets_json.h>
#include <ensonify/engine/scene/dump.h>
#include <ensonify/engine/simulator/ping_all.h>

namespace ensonify::python {
namespace {

/// A NumPy array over the memory of a layer, which `owner` keeps alive.
template <class T>
py::array array_of(const std::vector<T>& values, std::vector<py::ssize_t> shape,
                   const py::object& owner) {
  return py::array_t<T>(std::move(shape), values.data(), owner);
}

/// The layer of a line or an image with the name `wanted`.
py::array layer_of(const py::object& self, const std::string& wanted, const BinLayers& layers,
                   const std::vector<py::ssize_t>& shape) {
  std::optional<py::array> found;
  BinLayers::for_each([&](std::string_view name, auto layer) {
    if (name == wanted) found = array_of(layers.*layer, shape, self);
  });
  if (!found)
    throw py::key_error(fmt::format("there is no layer '{}'; there are: {}", wanted,
                                    fmt::join(layer_names(), ", ")));
  return *found;
}

py::array layer_of_line(const py::object& self, const std::string& name) {
  const BinLayers& bins = self.cast<const Line&>().line.bins;
  return layer_of(self, name, bins, {static_cast<py::ssize_t>(bins.range_m.size())});
}

/// All pings of a sonar, and what the files of a run have in addition to the layers.
struct Image {
  Waterfall waterfall;
  std::vector<Attribute> attributes;
  std::string targets;  // as JSON
  std::vector<std::string> classes, materials;
};

}  // namespace
template <>
constexpr bool is_class_of_module<Image> = true;
namespace {

py::array layer_of_image(const py::object& self, const std::string& name) {
  const Waterfall& image = self.cast<const Image&>().waterfall;
  return layer_of(
      self, name, image.pixels,
      {static_cast<py::ssize_t>(image.rows()), static_cast<py::ssize_t>(image.columns())});
}

/// A list of one value of each ping.
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

/// All pings of a scene: an image for each sonar, by the sonar's name, in the scene's order.
py::dict images(const py::object& given, const py::object& keys, const fs::path& data,
                const std::optional<fs::path>& cache, int threads, const py::object& progress) {
  const Scene scene = scene_of(given, keys, data).with();
  std::vector<std::unique_ptr<Image>> made;
  {
    const FreeInterpreter unlocked;
    const auto report = [&](std::string_view stage, std::size_t done, std::size_t of) {
      const py::gil_scoped_acquire locked;
      check_interpreter();
      if (!progress.is_none()) progress(std::string(stage), done, of);
    };
    Simulator simulator(scene, {.cache = cache_of(cache),
                                .threads = threads,
                                .progress = [&](auto stage) { report(stage, 0, 1); },
                                .stop_check = interpreter_check()});
    ScenePings pings =
        ping_all(scene, simulator, threads,
                 [&](auto, std::size_t done, std::size_t of) { report("pings", done, of); });
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
      made.push_back(
          std::make_unique<Image>(Image{std::move(waterfall), std::move(attributes),
                                        std::move(targets), names.classes, names.materials}));
    }
  }
  py::dict by_name;
  for (std::unique_ptr<Image>& image : made) {
    const std::string name = image->waterfall.sonar.name;
    by_name[name.c_str()] = std::move(image);
  }
  return by_name;
}

}  // namespace

std::vector<std::string> layer_names() {
  std::vector<std::string> names;
  BinLayers::for_each([&](std::string_view name, auto) { names.emplace_back(name); });
  return names;
}

void add_results(py::module_& module) {
  py::class_<Line> line(module, "EchoLine", R"(One side of one ping of a sonar, or one of its beams.

line["intensity"] is a layer of it: a NumPy array of (bins,), from near to far, over the line's own
memory, float32 or uint32. `ensonify.layers` lists the names.)");
  refuse_pickle(line, "use its layers, as line[\"intensity\"]");
  line.def_readonly("sonar", &Line::sonar, "The sonar's name.")
      .def_readonly("side", &Line::sector_name,
                    "The name of its sector: \"port\" or \"starboard\".")
      .def_property_readonly(
          "sector", [](const Line& self) { return self.line.sector; },
          "The number of its sector, from 0, among those that the sonar has.")
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
        return fmt::format("<EchoLine of {}, {}, {} bins>", self.sonar, self.sector_name,
                           self.line.bins.range_m.size());
      });

  py::class_<Image> image(module, "Image", R"(All pings of a sonar.

image["intensity"] is a layer of it: a NumPy array of (pings, samples) over the image's own memory,
float32 or uint32. The oldest ping is row 0. If the sonar has several `beams`, each beam of a ping
is a row, the rear beam first, and counts as a ping here. Columns are port from far to near, then
starboard from near to far. `layers` lists the names.)");
  refuse_pickle(image, "use its layers, as image[\"intensity\"]");
  image
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
          "The vehicle's true Pose at each ping; of several beams, as far along the array as each.")
      .def_property_readonly(
          "reported_poses", [](const Image& self) { return by_ping(self, &PingRow::reported); },
          "The Pose that the vehicle's navigation reports at each ping.")
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
pings - 1 - r here. Columns are always the columns of the layers, in slant range. With
display.slant_range_correction or display.speed_correction they differ from the columns in a run's
file, which are those of the run's picture.)")
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

  module.def(
      "_sonars",
      [](const py::object& given, const py::object& keys, const fs::path& data) {
        std::vector<std::string> names;
        for (const Sonar& sonar : scene_of(given, keys, data).with().sonars)
          names.push_back(sonar.name);
        return names;
      },
      "The names of a scene's sonars.");
  module.def("images", &images, py::arg("scene"), py::kw_only(), py::arg("keys") = py::none(),
             py::arg("data") = "", py::arg("cache") = py::none(), py::arg("threads") = 0,
             py::arg("progress") = py::none(),
             R"(images(scene, *, keys=None, data='', cache=None, threads=0, progress=None)
--

Simulates every ping of a scene. Returns a dict from each sonar's name to its Image, in the scene's
order.

scene: a scene file's path, or a dict of the same keys. keys: keys to change, such as
{"track.altitude_m": 4}. data: the folder of `data:` paths (default: ENSONIFY_DATA). cache: the
folder for analysed seafloors (default: ~/.cache/ensonify). threads: 0 for one per core.
progress(stage, done, of) is called repeatedly, from any thread. If it raises an exception, the work
ends; Ctrl-C ends it, too.

Raises SceneError or MeshError (both are ValueErrors) if the scene or one of its files is wrong,
ValueError for a wrong number of threads, and TypeError for a value whose type no key of a scene
has.)");
}

}  // namespace ensonify::python
