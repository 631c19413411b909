#include "module.h"

#include <algorithm>
#include <limits>

#include <fmt/format.h>

#include <ensonify/engine/recording/recording_reader.h>

namespace ensonify::python {
template <>
constexpr bool is_class_of_module<RecordedLine> = true;
namespace {

/// The samples of a side, as an array over the line's memory; None if the line lacks the side.
py::object samples_of(const py::object& self, Side side) {
  const auto& line = self.cast<const RecordedLine&>();
  const std::vector<float>& samples = line.side(side);
  if (samples.empty()) return py::none();
  return py::array_t<float>({line.pings.size(), line.samples}, samples.data(), self);
}

}  // namespace

void add_recordings(py::module_& module) {
  py::class_<RecordedLine> line(
      module, "RecordedLine",
      R"(The pings of one sonar of a recording, or of one of its frequencies.

Numbers are NumPy arrays with one value per ping, (pings,): metres, degrees, seconds; NaN where the
file does not state them.)");
  refuse_pickle(line, "read the file again, or use its arrays");
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
        const FreeInterpreter unlocked;
        return read_recording(file);
      },
      py::arg("file"), R"(read_recording(file)
--

Reads the sidescan channels of an XTF or JSF recording: a list of a RecordedLine for each sonar or
frequency, at least one. If a file states that its samples begin after the transmission (TimeDelay
of XTF), as many samples of 0 come before them. Damaged packets are left out, with a warning. Raises
RecordingError (a ValueError) for a file that cannot be read, has another format, or has no sidescan
samples.)");
}

}  // namespace ensonify::python
