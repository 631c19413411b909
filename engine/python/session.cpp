#include "module.h"

#include <atomic>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <thread>
#include <utility>

#include <fmt/format.h>

#include <ensonify/engine/base/calls_at_fork.h>
#include <ensonify/engine/scene/checks/extrapolation.h>
#include <ensonify/refine/printable.h>

namespace ensonify::python {
namespace {

/// A table of three columns, with numbers of type T. `kinds` are the letters of the NumPy kinds
/// that are accepted; `what` describes them in messages. An empty list is a table without rows.
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

std::vector<std::string> copied(std::span<const std::string> names) {
  return {names.begin(), names.end()};
}

/// A Simulator for several Python threads. One at a time uses it, without the interpreter's lock.
class Session {
 public:
  Session(const py::object& scene, const py::object& keys, const fs::path& data,
          const std::optional<fs::path>& cache, int threads)
      : source_(scene_of(scene, keys, data)), scene_(source_.with()) {
    const FreeInterpreter unlocked;
    simulator_ =
        std::make_unique<Simulator>(scene_, Preparation{.cache = cache_of(cache),
                                                        .threads = threads,
                                                        .progress =
                                                            [](auto) {
                                                              const py::gil_scoped_acquire locked;
                                                              check_interpreter();
                                                            },
                                                        .stop_check = interpreter_check()});
  }

  /// Calls f(simulator) while no other thread uses the simulator; the interpreter's lock is free.
  /// Throws std::runtime_error if this thread is already in such a call: in a signal's handler,
  /// which runs in the middle of a ping.
  template <class F>
  auto alone(F&& f) {
    if (inside_ == std::this_thread::get_id())
      throw std::runtime_error(
          "this Simulator is in the midst of a call, which a signal has interrupted; call it after "
          "that, not in the signal's handler");
    const CallsAtFork::Call call(calls_);  // before mutex_, which stays locked in a child of fork()
    const FreeInterpreter unlocked;
    const std::lock_guard guard(mutex_);
    struct Inside {
      std::atomic<std::thread::id>& id;
      explicit Inside(std::atomic<std::thread::id>& its) : id(its) {
        id = std::this_thread::get_id();
      }
      ~Inside() { id = std::thread::id(); }
    } const inside(inside_);
    return f(*simulator_);
  }

  std::vector<Line> ping(const Pose& pose, std::optional<std::uint64_t> number) {
    std::string warning;
    std::uint64_t sent = 0;
    std::vector<Line> lines = alone([&](Simulator& simulator) {
      const std::size_t warnings = simulator.warnings().size();
      sent = number.value_or(next_ping_);
      simulator.ping_numbered(pose, sent);
      if (!number) ++next_ping_;
      if (simulator.warnings().size() > warnings) warning = simulator.warnings().back();
      std::vector<EchoLine> lines = simulator.take_lines();
      std::vector<Line> owned;
      auto next = lines.begin();
      for (const Sonar& sonar : simulator.sonars())
        for (int i = 0; i < static_cast<int>(sonar.sectors().size()) * sonar.beams; ++i, ++next)
          owned.push_back({sonar.name, sonar.sectors()[next->sector].name, std::move(*next)});
      return owned;
    });
    if (!warning.empty() &&
        PyErr_WarnEx(PyExc_UserWarning, refine::printable(warning).c_str(), 1) != 0) {
      const py::error_already_set error;
      // The warning became an exception, so the caller gets no lines and the ping takes no number,
      // unless another thread has taken the next number meanwhile.
      alone([&](Simulator&) {
        if (!number && next_ping_ == sent + 1) next_ping_ = sent;
      });
      throw error;
    }
    return lines;
  }

  void set(const py::object& keys) {
    const std::vector<KeyValue> changes = key_values(keys, "keys");
    alone([&](Simulator& simulator) { set_sonars(simulator, source_, changes); });
  }

  std::vector<std::string> warnings() {
    return alone([&](Simulator& simulator) {
      std::vector<std::string> all = warnings_for_single_pings(scene_);
      all.insert(all.begin(), simulator.warnings().begin(), simulator.warnings().end());
      return Extrapolation(simulator.sonars(), simulator.materials(), scene_.materials)
          .appended_to(all);
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
    // 64 bits with a sign, in which a number that is too large for a vertex stays too large.
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
    const std::vector<KeyValue> values = key_values(keys, "the object");
    return alone([&](Simulator& simulator) {
      return simulator.add(
          object_of(values, "the object", scene_, source_.paths(), simulator.next_instance()),
          pose);
    });
  }

 private:
  SessionScene source_;  // protected by mutex_ once there is a simulator
  const Scene scene_;    // as it was read, without later changes
  std::unique_ptr<Simulator> simulator_;
  std::uint64_t next_ping_ = 0;  // protected by mutex_
  CallsAtFork calls_;
  std::mutex mutex_;
  std::atomic<std::thread::id> inside_{};  // the thread that has locked mutex_
};

}  // namespace
template <>
constexpr bool is_class_of_module<Session> = true;

void add_simulator(py::module_& module) {
  py::class_<Session> simulator(module, "Simulator",
                                R"(Simulator(scene, *, keys=None, data='', cache=None, threads=0)
--

A scene that is ready, so that it can ping from any pose.

scene: a scene file's path, or a dict of the same keys. keys: keys to change, such as
{"sea.temperature_c": 4}. data: the folder of `data:` paths (default: ENSONIFY_DATA). cache: the
folder for analysed seafloors (default: ~/.cache/ensonify). threads: the number of threads that make
the scene ready (0: one per core).

Any thread may call it; calls run one after another. Other Python threads can run during a call. If
a signal's handler calls it during a call, this raises RuntimeError. Raises SceneError or MeshError
(both are ValueErrors) if the scene or one of its files is wrong, ValueError for a wrong number of
threads, and TypeError for a value whose type no key of a scene has.)");
  refuse_pickle(simulator, "make one of the same scene");
  simulator
      .def(py::init<const py::object&, const py::object&, const fs::path&,
                    const std::optional<fs::path>&, int>(),
           py::arg("scene"), py::kw_only(), py::arg("keys") = py::none(), py::arg("data") = "",
           py::arg("cache") = py::none(), py::arg("threads") = 0)
      .def("ping", &Session::ping, py::arg("pose"), py::arg("number") = py::none(),
           R"(ping(self, pose, number=None)
--

Makes one ping of every sonar, with the vehicle at a pose. The pulse is sent at pose.t_s.

Returns a list of EchoLines: the sides that the first sonar has (port, then starboard), then those
of the next sonar. `number` selects the random numbers: the same number and pose give the same ping
again. If no number is given, the session's next number is used, from 0; a ping that raises an
exception uses none. No ping is lost or repeated: `artefacts.lost` and `artefacts.repeated` have an
effect only on whole tracks, as in images(). Raises ValueError for a pose that is not finite, that
lies beyond 1e8 m, that turns faster than a million degrees per second, that puts a sonar above the
sea surface (z_m >= 0) or below the bed, or that moves the vehicle or a sonar as fast as sound.
Warns once if a pose is out of reach of the seafloor.)")
      .def("set", &Session::set, py::arg("keys"), R"(set(self, keys)
--

Changes keys of sonars from the next ping on, such as {"sonar.sidescan.range_m": 40}.

Raises SceneError (a ValueError) for a key that is not of a sonar, and for a value that a scene
refuses. Then nothing is changed.)")
      .def("add", &Session::add, py::arg("object"), py::arg("pose"), R"(add(self, object, pose)
--

Puts an object into the scene, and returns its instance number.

object: a dict of the keys of a scene's [[objects]], such as {"shape": "barrel"}. Without
"shape_seed" the form of a boulder or wreck follows from the scene's seed and the instance. The pose
places the middle of the object's bounds. The object's z is up, and its y is where the heading
points. Raises SceneError for wrong keys, ValueError for a pose that is not finite or lies beyond
1e8 m.)")
      .def("add_mesh", &Session::add_mesh, py::arg("vertices"), py::arg("faces"), py::arg("pose"),
           py::kw_only(), py::arg("material") = "fouled steel", py::arg("class_name") = "object",
           R"(add_mesh(self, vertices, faces, pose, *, material='fouled steel', class_name='object')
--

Puts a mesh into the scene, and returns its instance number.

vertices: (n, 3) metres, z up, y where the pose's heading points. faces: (m, 3) numbers of vertices.
A closed mesh scatters on its outside, an open mesh on both sides of its faces. Raises ValueError
for arrays of other shapes or an unknown material, TypeError if the faces are not whole numbers or
the vertices are not real numbers, and MeshError for a vertex that does not exist, is not finite or
lies beyond 1e8 m.)")
      .def(
          "move",
          [](Session& self, std::uint32_t instance, const Pose& pose) {
            self.alone([&](Simulator& simulator) { simulator.move(instance, pose); });
          },
          py::arg("instance"), py::arg("pose"), R"(move(self, instance, pose)
--

Moves an object that was added. (The objects of the scene are fixed.) Raises ValueError for an
instance that is not there.)")
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

The height over the bed straight below a pose, metres; objects are ignored. Negative below the
bed, NaN over a hole and off the seafloor.)")
      .def(
          "track",
          [](Session& self) {
            return self.alone([](Simulator& simulator) { return simulator.track(); });
          },
          R"(track(self)
--

The vehicle's Pose at each ping of the scene's track, a list. Raises SceneError for a track that
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
          "Warnings about the scene: repairs of meshes, a ping out of reach, and those of settings, "
          "all since the beginning; models outside their range, with the present settings.");
}

}  // namespace ensonify::python
