#include <ensonify/engine/dataset/card.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <ensonify/engine/base/json_text.h>

namespace ensonify::engine {
namespace {

using Json = nlohmann::ordered_json;

/// The context that Croissant's appendix 1 recommends, as far as this file uses its words.
Json context() {
  Json json = {{"@language", "en"},
               {"@vocab", "https://schema.org/"},
               {"sc", "https://schema.org/"},
               {"cr", "http://mlcommons.org/croissant/"},
               {"dct", "http://purl.org/dc/terms/"},
               {"conformsTo", "dct:conformsTo"},
               {"data", {{"@id", "cr:data"}, {"@type", "@json"}}},
               {"dataType", {{"@id", "cr:dataType"}, {"@type", "@vocab"}}}};
  for (const char* word : {"extract", "field", "fileProperty", "fileSet", "includes", "key",
                           "recordSet", "regex", "source", "transform"})
    json[word] = std::string("cr:") + word;
  return json;
}

Json field(const std::string& id, const std::string& type) {
  return {{"@type", "cr:Field"}, {"@id", id}, {"name", id}, {"dataType", type}};
}

/// The records of a group of pictures: each picture, its file and its split, which is the name of
/// its folder.
Json pictures_of(const std::string& group) {
  const Json set = {{"@id", group + "_pictures"}};
  Json image = field(group + "/image", "sc:ImageObject");
  image["source"] = {{"fileSet", set}, {"extract", {{"fileProperty", "content"}}}};
  Json name = field(group + "/file_name", "sc:Text");
  name["source"] = {{"fileSet", set}, {"extract", {{"fileProperty", "filename"}}}};
  Json split = field(group + "/split", "sc:Text");
  split["source"] = {{"fileSet", set},
                     {"extract", {{"fileProperty", "fullpath"}}},
                     {"transform", {{"regex", ".*/(train|val|test)/[^/]*"}}}};
  return {{"@type", "cr:RecordSet"},
          {"@id", group},
          {"name", group},
          {"key", {{"@id", group + "/file_name"}}},
          {"field", {image, name, split}}};
}

/// The numbers and names of the classes.
Json classes_of(const Card& card) {
  Json data = Json::array();
  for (std::size_t i = 0; i < card.classes.size(); ++i)
    data.push_back({{"classes/number", i + 1}, {"classes/name", card.classes[i]}});
  return {{"@type", "cr:RecordSet"},
          {"@id", "classes"},
          {"name", "classes"},
          {"dataType", "sc:Enumeration"},
          {"key", {{"@id", "classes/number"}}},
          {"field", {field("classes/number", "sc:Integer"), field("classes/name", "sc:Text")}},
          {"data", data}};
}

}  // namespace

std::string croissant_json(const Card& card, std::span<const IndexFile> files) {
  Json distribution = Json::array(), records = Json::array({classes_of(card)});
  for (const IndexFile& file : files)
    distribution.push_back(
        {{"@type", "cr:FileObject"},
         {"@id", file.name},
         {"name", file.name},
         {"contentUrl", file.name},
         {"contentSize", fmt::format("{} B", file.size_bytes)},
         {"encodingFormat",
          file.name.ends_with(".jsonl") ? "application/jsonlines" : "application/json"},
         {"sha256", file.sha256}});
  for (const auto& [group, splits] : card.hub) {
    distribution.push_back({{"@type", "cr:FileSet"},
                            {"@id", group + "_pictures"},
                            {"name", group + "_pictures"},
                            {"encodingFormat", "image/png"},
                            {"includes", fmt::format("hub/{}/*/*.png", group)}});
    records.push_back(pictures_of(group));
  }
  Json json = {{"@context", context()},
               {"@type", "sc:Dataset"},
               {"conformsTo", "http://mlcommons.org/croissant/1.0"},
               {"name", card.heading()},
               {"description", card.description()},
               {"version", "1.0.0"}};
  if (!card.licence.empty())
    json["license"] = fmt::format("https://spdx.org/licenses/{}", card.licence);
  if (!card.url.empty()) json["url"] = card.url;
  if (!card.creator.empty()) json["creator"] = {{"@type", "sc:Person"}, {"name", card.creator}};
  if (!card.published.empty()) json["datePublished"] = card.published;
  json["distribution"] = distribution;
  json["recordSet"] = records;
  return json_text(json, 1) + "\n";
}

}  // namespace ensonify::engine
