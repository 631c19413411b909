#include <ensonify/engine/dataset/card.h>

#include <algorithm>
#include <array>
#include <iterator>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include <ensonify/engine/base/json_text.h>
#include <ensonify/engine/base/lower_case.h>
#include <ensonify/refine/printable.h>

namespace ensonify::engine {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t bins = 10, longest_bar = 40;

std::string bar(std::size_t count, std::size_t most) {
  return std::string(most > 0 ? (count * longest_bar + most - 1) / most : 0, '#');
}

/// The Hub's word for a number of pictures.
std::string_view size_category(std::size_t pictures) {
  return pictures < 1000      ? "n<1K"
         : pictures < 10000   ? "1K<n<10K"
         : pictures < 100000  ? "10K<n<100K"
         : pictures < 1000000 ? "100K<n<1M"
                              : "1M<n<10M";
}

/// The configurations of a group for the Hub's ImageFolder. ImageFolder finds the types of the
/// columns in the first rows of each split's metadata.jsonl, and refuses a configuration whose
/// splits have different types (folder_based_builder.py), also if the card states the types. In a
/// split without any target the boxes are empty lists, which have no type. So such splits have a
/// separate configuration.
std::string configs_of(const std::string& group, const std::map<std::string, bool>& splits) {
  std::map<std::string, std::string> paths;  // by the name of the configuration
  const bool any_targets = std::ranges::any_of(splits, [](const auto& one) { return one.second; });
  for (const auto& [split, has_targets] : splits)
    paths[has_targets || !any_targets ? group : group + "_without_targets"] +=
        fmt::format("  - split: {}\n    path: hub/{}/{}/*\n", split == "val" ? "validation" : split,
                    group, split);
  std::string text;
  for (const auto& [name, lines] : paths)
    text += fmt::format("- config_name: {}\n  data_files:\n{}", name, lines);
  return text;
}

/// The part of a card that the Hub reads, for load_dataset(FOLDER, GROUP) to find pictures and
/// splits.
std::string hub_metadata(const Card& card) {
  std::string text;
  const auto out = std::back_inserter(text);
  const auto quoted = [](const std::string& word) { return nlohmann::json(word).dump(); };
  fmt::format_to(out, "---\npretty_name: {}\n", quoted(card.heading()));
  if (!card.licence.empty()) fmt::format_to(out, "license: {}\n", quoted(lower_case(card.licence)));
  text +=
      "task_categories:\n- object-detection\n- image-segmentation\n"
      "tags:\n- sonar\n";
  for (const std::string_view kind : {"sidescan", "imaging"})
    if (card.sonars().find(kind) != std::string::npos) fmt::format_to(out, "- {}-sonar\n", kind);
  text += "- synthetic\n";
  std::size_t pictures = 0;
  for (const auto& [group, count] : card.images) pictures += count;
  fmt::format_to(out, "size_categories:\n- {}\n", size_category(pictures));
  if (!card.hub.empty()) text += "configs:\n";
  for (const auto& [group, splits] : card.hub) text += configs_of(group, splits);
  return text + "---\n\n";
}

/// A text as one printable line of Markdown: for a cell of a table, an item of a list or a heading.
std::string one_line(std::string_view text) {
  std::string line;
  for (const char c : text) {
    if (c == '|' || c == '\\') line += '\\';
    line += c == '\n' || c == '\r' ? ' ' : c;
  }
  return refine::printable(line);
}

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

/// The records of a group of pictures: each picture, its file, and its split (the folder's name).
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

std::string Realised::text() const {
  std::string text;
  const auto out = std::back_inserter(text);
  if (!numbers_.empty()) {
    const auto [least, most] = std::minmax_element(numbers_.begin(), numbers_.end());
    const double low = *least, width = (*most - *least) / bins;
    std::array<std::size_t, bins> counts{};
    for (const double number : numbers_)
      ++counts[width > 0.0 ? std::min(bins - 1, static_cast<std::size_t>((number - low) / width))
                           : 0];
    const std::size_t largest = *std::ranges::max_element(counts);
    for (std::size_t i = 0; i < (width > 0.0 ? bins : 1); ++i)
      fmt::format_to(out, "{:>10.4g} {:>6} {}\n", low + static_cast<double>(i) * width, counts[i],
                     bar(counts[i], largest));
    fmt::format_to(out, "{:>10.4g}\n", *most);
  }
  std::size_t largest = 0;
  for (const auto& [word, count] : words_) largest = std::max(largest, count);
  for (const auto& [word, count] : words_)
    fmt::format_to(out, "{:>24} {:>6} {}\n", word, count, bar(count, largest));
  return text;
}

std::string Card::sonars() const {
  const auto frames = static_cast<std::size_t>(std::ranges::count_if(
      images, [](const auto& group) { return group.first.find("_frame,") != std::string::npos; }));
  if (frames == 0) return "sidescan sonar";
  return frames == images.size() ? "imaging sonar" : "sidescan and imaging sonar";
}

std::string Card::heading() const {
  return title.empty() ? fmt::format("A dataset of simulated {}", sonars()) : title;
}

std::string Card::description() const {
  return fmt::format(
      "Simulated {}: {} samples over {} seafloors, made by ensonify {} from a recipe, with labels "
      "of every pixel.",
      sonars(), samples, seafloors, version);
}

std::string Card::markdown() const {
  std::string text = hub_metadata(*this);
  const auto out = std::back_inserter(text);
  fmt::format_to(out, "# {}\n\n{}\n", one_line(heading()), description());
  if (!licence.empty()) fmt::format_to(out, "\nLicence: {}\n", one_line(licence));
  if (!pictures.empty()) text += "\n## Pictures\n\n";
  for (const std::string& picture : pictures) fmt::format_to(out, "![{0}]({0})\n", picture);
  text += "\n## Splits\n\n| split | samples |\n|---|---|\n";
  for (const auto& [split, count] : samples_by_split)
    fmt::format_to(out, "| {} | {} |\n", split, count);
  text += "\n## Images\n\n| geometry, kind, split | images |\n|---|---|\n";
  for (const auto& [group, count] : images) fmt::format_to(out, "| {} | {} |\n", group, count);
  text += "\n## Targets in whole lines and frames\n\n| class | split | targets |\n|---|---|---|\n";
  for (const auto& [name, by_split] : targets)
    for (const auto& [split, count] : by_split)
      fmt::format_to(out, "| {} | {} | {} |\n", one_line(name), split, count);
  text +=
      "\n## Labels\n\n0 is none; ignore 255 (65535 for instances).\n\n"
      "| number | class | sediment |\n|---|---|---|\n";
  for (std::size_t i = 0; i < std::max(classes.size(), sediments.size()); ++i)
    fmt::format_to(out, "| {} | {} | {} |\n", i + 1, i < classes.size() ? one_line(classes[i]) : "",
                   i < sediments.size() ? one_line(sediments[i]) : "");
  text += "\n## Assets and licences\n\n";
  if (assets.empty() && licences.empty()) text += "No external files: everything is generated.\n";
  for (const std::string& asset : assets) fmt::format_to(out, "- {}\n", one_line(asset));
  for (const std::string& line : licences) fmt::format_to(out, "- {}\n", one_line(line));
  const auto histograms = [&](std::string_view heading,
                              const std::map<std::string, Realised>& all) {
    if (all.empty()) return;
    fmt::format_to(out, "\n## {}\n", heading);
    for (const auto& [name, realised] : all)
      fmt::format_to(out, "\n`{}`\n\n```\n{}```\n", name, realised.text());
  };
  histograms("Measured values of the targets", measured);
  histograms("Drawn values", drawn);
  text += "\n## Recipe\n\n";
  if (!overrides.empty())
    fmt::format_to(out, "Changed on the command line: `-D {}`.\n\n",
                   fmt::join(overrides, "`, `-D "));
  fmt::format_to(out, "```toml\n{}```\n", recipe);
  return text;
}

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
