#include "module.h"

#include <cstdlib>
#include <utility>

#include <fmt/format.h>

#include <ensonify/engine/base/untrusted.h>
#include <ensonify/engine/scene/keys/key_text.h>

namespace ensonify::python {
namespace {

std::string type_name(const py::handle& value) {
  return py::str(py::type::of(value).attr("__name__")).cast<std::string>();
}

/// A Python mapping as a dict. `name` is its name in the TypeError for another value.
py::dict dict_of(const py::handle& value, std::string_view name) {
  if (value.is_none()) return {};
  if (!py::hasattr(value, "keys"))
    throw py::type_error(
        fmt::format("{} is a {}, expected a dict of a scene's keys", name, type_name(value)));
  return py::reinterpret_steal<py::dict>(
      py::module_::import("builtins").attr("dict")(value).release());
}

/// A Python string as UTF-8. Throws ValueError for half of a surrogate pair.
std::string utf8_of(const py::handle& text) {
  py::ssize_t size = 0;
  const char* bytes = PyUnicode_AsUTF8AndSize(text.ptr(), &size);
  if (bytes) return {bytes, static_cast<std::size_t>(size)};
  PyErr_Clear();
  throw py::value_error(
      fmt::format("{} is not valid Unicode; remove the lone surrogate",
                  py::reinterpret_steal<py::str>(PyObject_ASCII(text.ptr())).cast<std::string>()));
}

/// A Python object as a TOML value, with tables on one line. `path` is its key. Throws ValueError
/// for a value that is nested too deeply, TypeError for a value that no scene has.
std::string toml_of(const py::handle& value, const std::string& path, int depth = 0) {
  if (depth > most_levels)  // a list that contains itself has no end
    throw py::value_error(fmt::format("'{}' has values more than {} deep in each other",
                                      path.substr(0, path.find('.')), most_levels));
  if (py::isinstance<py::bool_>(value)) return value.cast<bool>() ? "true" : "false";
  if (py::isinstance<py::str>(value)) return toml_string(utf8_of(value));
  if (py::hasattr(value, "tolist"))  // an array or a number of NumPy
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

fs::path data_folder_of(const fs::path& data) {
  if (!data.empty()) return data;
  const char* folder = std::getenv("ENSONIFY_DATA");
  return folder ? folder : "";
}

}  // namespace

std::vector<KeyValue> key_values(const py::handle& keys, std::string_view name) {
  std::vector<KeyValue> all;
  for (const auto& [key, value] : dict_of(keys, name)) {
    std::string text = utf8_of(py::str(key));
    std::string toml = toml_of(value, text);
    all.push_back({std::move(text), std::move(toml)});
  }
  return all;
}

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
  fs::path file;
  try {
    file = given.cast<fs::path>();
  } catch (const py::cast_error&) {
    throw py::value_error(fmt::format("the scene's path {} has a character that no path can have",
                                      py::repr(given).cast<std::string>()));
  }
  return SessionScene::of_file(file, std::move(overrides), data_folder);
}

fs::path cache_of(const std::optional<fs::path>& cache) { return cache ? *cache : default_cache(); }

}  // namespace ensonify::python
