#include <ensonify/engine/seafloor/analysis.h>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <ensonify/engine/base/json_text.h>
#include <ensonify/engine/base/untrusted.h>
#include <ensonify/engine/trace/face_sources/exact_faces.h>
#include <ensonify/refine/progressive_mesh_file.h>

namespace ensonify::engine {
namespace {

using Json = nlohmann::ordered_json;

Json to_json(const Label& label) {
  return {label.sediment, label.class_id, label.instance, label.two_sided, label.feature};
}

Label label_of(const Json& json, const Seafloor& seafloor) {
  constexpr std::uint64_t most = std::numeric_limits<std::uint16_t>::max();
  Label label;
  whole_numbers(json.at(0), most).get_to(label.sediment);
  whole_numbers(json.at(1), most).get_to(label.class_id);
  whole_numbers(json.at(2), most).get_to(label.instance);
  json.at(3).get_to(label.two_sided);
  json.at(4).get_to(label.feature);
  static_cast<void>(seafloor.materials.at(label.sediment));  // throws
  static_cast<void>(seafloor.classes.at(label.class_id));
  return label;
}

Json to_json(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

Eigen::Vector3d vector_of(const Json& json) {
  return {json.at(0).get<double>(), json.at(1).get<double>(), json.at(2).get<double>()};
}

/// What the file has in addition to the faces and their label numbers: a JSON text, a byte 0, and
/// the meshes of the objects.
std::string about(const Seafloor& seafloor) {
  Json labels = Json::array();
  for (const Label& label : seafloor.labels) labels.push_back(to_json(label));
  Json objects = Json::array();
  for (const ObjectRecord& object : seafloor.objects)
    objects.push_back({{"table", object.table},
                       {"middle_m", to_json(object.middle_m)},
                       {"size_m", to_json(object.size_m)},
                       {"heading_rad", object.heading_rad},
                       {"scale", object.scale},
                       {"buried", object.buried},
                       {"label", to_json(object.label)}});
  Json features = Json::array();
  for (const FeatureRecord& feature : seafloor.features)
    features.push_back({{"layer", feature.layer},
                        {"middle_m", to_json(feature.middle_m)},
                        {"size_m", to_json(feature.size_m)},
                        {"label", to_json(feature.label)}});
  Json json{{"vertices", seafloor.vertices},
            {"faces", seafloor.faces},
            {"bed_faces", seafloor.bed_faces},
            {"mean_bed_m", seafloor.mean_bed_m},
            {"utm_zone", seafloor.utm_zone},
            {"labels", labels},
            {"classes", seafloor.classes},
            {"materials", seafloor.materials},
            {"objects", objects},
            {"features", features},
            {"repairs", seafloor.repairs},
            {"warnings", seafloor.warnings}};
  if (!seafloor.reference.empty()) json["reference"] = seafloor.reference;
  return json_text(json) + '\0' + bytes_of(seafloor.object_meshes);
}

/// Reads what about() made. Throws std::invalid_argument or Json::exception, or std::out_of_range
/// for numbers that contradict one another.
void take(std::string_view about, Seafloor& seafloor) {
  const std::size_t end = std::min(about.find('\0'), about.size());
  const Json json = json_of<Json>(about.substr(0, end));
  seafloor.object_meshes = object_meshes_of(about.substr(std::min(end + 1, about.size())));
  whole_numbers(json.at("vertices")).get_to(seafloor.vertices);
  whole_numbers(json.at("faces")).get_to(seafloor.faces);
  whole_numbers(json.at("bed_faces")).get_to(seafloor.bed_faces);
  json.at("mean_bed_m").get_to(seafloor.mean_bed_m);
  if (!json.at("utm_zone").is_number_integer()) throw std::out_of_range("utm_zone");
  json.at("utm_zone").get_to(seafloor.utm_zone);
  seafloor.reference = json.value("reference", "");  // older files have none
  json.at("classes").get_to(seafloor.classes);
  json.at("materials").get_to(seafloor.materials);
  whole_numbers(json.at("repairs")).get_to(seafloor.repairs);
  json.at("warnings").get_to(seafloor.warnings);
  for (const Json& entry : json.at("labels")) seafloor.labels.push_back(label_of(entry, seafloor));
  for (const Json& entry : json.at("objects"))
    seafloor.objects.push_back({.table = whole_numbers(entry.at("table")).get<std::size_t>(),
                                .middle_m = vector_of(entry.at("middle_m")),
                                .size_m = vector_of(entry.at("size_m")),
                                .heading_rad = entry.at("heading_rad").get<double>(),
                                .scale = entry.at("scale").get<double>(),
                                .buried = entry.at("buried").get<double>(),
                                .label = label_of(entry.at("label"), seafloor)});
  for (const Json& entry : json.at("features"))
    seafloor.features.push_back({.layer = entry.at("layer").get<std::string>(),
                                 .middle_m = vector_of(entry.at("middle_m")),
                                 .size_m = vector_of(entry.at("size_m")),
                                 .label = label_of(entry.at("label"), seafloor)});
  const bool fits = !seafloor.labels.empty() && seafloor.bed_faces <= seafloor.faces &&
                    seafloor.faces <= seafloor.progressive->faces.size();
  if (!fits) throw std::out_of_range("faces");
  std::size_t of_objects = 0;
  for (const ObjectMesh& mesh : seafloor.object_meshes) of_objects += mesh.faces.size();
  if (seafloor.object_meshes.size() != seafloor.objects.size() ||
      of_objects != seafloor.faces - seafloor.bed_faces)
    throw std::out_of_range("objects");
}

}  // namespace

void analyse(Seafloor& seafloor, int threads, const std::function<void()>& stop_check) {
  seafloor.progressive = make_progressive_mesh(seafloor.mesh, threads, stop_check);
  seafloor.mesh = {{}, {}, seafloor.mesh.world_origin};
}

void save_analysed(const Seafloor& seafloor, const std::string& key,
                   const std::filesystem::path& file) {
  std::vector<std::uint16_t> tags(seafloor.face_label.empty() ? 0 : seafloor.first_labelled, 0);
  tags.insert(tags.end(), seafloor.face_label.begin(), seafloor.face_label.end());
  refine::save(*seafloor.progressive, {.tags = tags, .about = about(seafloor), .key = key}, file);
}

Seafloor open_analysed(const std::filesystem::path& file) {
  Seafloor seafloor;
  seafloor.labels.clear();
  seafloor.progressive =
      std::make_shared<const refine::ProgressiveMesh>(refine::map_progressive_mesh(file));
  seafloor.mesh.world_origin = seafloor.progressive->world_origin;
  try {
    take(seafloor.progressive->about(), seafloor);
  } catch (const std::exception&) {
    throw refine::MeshError(fmt::format(
        "{}: a progressive mesh without labels for its faces or without the shapes of its objects, "
        "which older versions did not keep; make it again with `ensonify analyse`",
        file.string()));
  }
  return seafloor;
}

Seafloor open_analysed(const std::filesystem::path& file, const std::string& key) {
  Seafloor seafloor = open_analysed(file);
  if (seafloor.progressive->key() != key)
    throw refine::MeshError(fmt::format("{}: was made from another seafloor", file.string()));
  return seafloor;
}

void restore_mesh(Seafloor& seafloor) {
  const auto from = std::exchange(seafloor.progressive, nullptr);
  from->verify_all();
  refine::TriangleMesh& mesh = seafloor.mesh;
  mesh.positions.assign(from->points.begin(), from->points.end());
  mesh.faces.resize(seafloor.faces);
  for (std::size_t slot = 0; slot < from->faces.size(); ++slot)
    if (const std::uint32_t face = from->source_face[slot]; face < mesh.faces.size())
      mesh.faces[face] = from->faces[slot];
  const auto last = static_cast<std::uint16_t>(seafloor.labels.size() - 1);
  seafloor.first_labelled = 0;
  for (std::uint32_t face = 0; face < from->tag_count(); ++face)
    seafloor.face_label.push_back(std::min(from->tag(face), last));
}

}  // namespace ensonify::engine
