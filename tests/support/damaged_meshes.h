#pragma once

#include <initializer_list>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "support/mesh_files.h"

namespace ensonify::tests {

/// The bytes, in which `with` replaces as many bytes from `place` on.
inline std::string patched(std::string bytes, std::size_t place, const std::string& with) {
  return bytes.replace(place, with.size(), with);
}

/// Words that are not accepted as numbers in any text format.
inline const std::initializer_list<std::pair<const char*, const char*>> bad_numbers = {
    {"a number is nan", "nan"},           {"a number is -NaN", "-NaN"},
    {"a number is inf", "inf"},           {"a number is -infinity", "-infinity"},
    {"a number overflows", "1e400"},      {"a number is 1e38", "1e38"},
    {"a number is a word", "two"},        {"a number has a decimal comma", "2,5"},
    {"a number is hexadecimal", "0x2"},   {"a number has two signs", "+-2"},
    {"a number has two points", "2.5.1"}, {"a number has no exponent", "2e"},
    {"a number has a backslash", "2\\0"}};

inline std::vector<DamagedMesh> damaged_ply() {
  std::vector<DamagedMesh> files;
  const auto add = [&](std::string what, std::string bytes) {
    files.push_back({Mesh::ply, std::move(what), std::move(bytes)});
  };
  const auto text = [&](std::string what, const std::string& from, const std::string& to) {
    add(std::move(what), replaced(text_ply, from, to));
  };
  add("empty file", "");
  add("only the magic", "ply\n");
  add("zero bytes", std::string(5000, '\0'));
  add("another format", text_obj);
  text("no magic", "ply\n", "");
  text("a blank line before the magic", "ply\n", "\nply\n");
  text("words after the magic", "ply\n", "ply 1\n");
  text("no format", "format ascii 1.0\n", "");
  text("two formats", "format ascii 1.0\n", "format ascii 1.0\nformat ascii 1.0\n");
  text("an unknown format", "ascii", "asci");
  text("an unknown version", "1.0", "2.0");
  text("no version", " 1.0", "");
  text("a word after the version", " 1.0", " 1.0 2");
  text("an unknown keyword", "element face", "elements face");
  text("no vertex element", "element vertex", "element vertices");
  text("no face element", "element face", "element faces");
  text("a second vertex element", "element face 4", "element vertex 0\nelement face 4");
  text("two vertex elements", "element face", "element vertex");
  text("no count", "vertex 4", "vertex");
  text("a negative count", "vertex 4", "vertex -4");
  text("a count with a point", "vertex 4", "vertex 4.0");
  text("a count in words", "vertex 4", "vertex four");
  text("two counts", "vertex 4", "vertex 4 4");
  text("a count over 64 bits", "vertex 4", "vertex 99999999999999999999");
  text("a count of 2^63-1", "vertex 4", "vertex 9223372036854775807");
  text("a count of 2^32+4", "vertex 4", "vertex 4294967300");
  text("a count of 5e8", "face 4", "face 500000000");
  text("no faces", "face 4", "face 0");
  text("no faces, and none there", "face 4\n", "face 0\n");
  text("a property before elements", "element vertex", "property int n\nelement vertex");
  text("an unknown type", "float x", "real x");
  text("a property without name", "float x", "float");
  text("a property with two names", "float x", "float x y");
  text("a property twice", "float y", "float x");
  text("no z", "float z", "float depth");
  text("x as a list", "float x", "list uchar float x");
  text("a float count of corners", "list uchar", "list float");
  text("float indices", "uchar int", "uchar float");
  text("no corners", "vertex_indices", "corners");
  text("corners that are no list", "list uchar int vertex_indices", "int vertex_indices");
  text("two lists of corners", "end_header", "property list uchar int vertex_index\nend_header");
  text("triangle strips", "element face 4\nproperty list uchar int vertex_indices",
       "element tristrips 1\nproperty list int int vertex_indices");
  text("no end_header", "end_header\n", "");
  text("a word after end_header", "end_header", "end_header now");
  for (const auto& [what, number] : bad_numbers)
    text(what, "\n2 0 0", "\n" + std::string(number) + " 0 0");
  text("a number has a zero byte", "2 0 0", std::string("2\0 0 0", 6));
  text("a short vertex", "2 0 0\n", "2 0\n");
  text("a long vertex", "2 0 0\n", "2 0 0 0\n");
  text("a vertex too few", "2 0 0\n", "");
  text("a vertex too many", "2 0 0\n", "2 0 0\n2 0 0\n");
  text("a face too few", "3 2 0 3\n", "");
  text("a face too many", "3 2 0 3\n", "3 2 0 3\n3 2 0 3\n");
  text("a short face", "3 1 2 3\n", "3 1 2\n");
  text("a long face", "3 1 2 3\n", "3 1 2 3 0\n");
  text("a face of two corners", "3 1 2 3\n", "2 1 2\n");
  text("a face of no corners", "3 1 2 3\n", "0\n");
  text("a face of -3 corners", "3 1 2 3\n", "-3 1 2 3\n");
  text("a face of 1e12 corners", "3 1 2 3\n", "1000000000000 1 2 3\n");
  for (const char* index :
       {"4", "-1", "2147483648", "4294967296", "4294967298", "18446744073709551617", "1.0", "one"})
    text(std::string("index ") + index, "3 1 2 3\n", std::string("3 1 ") + index + " 3\n");
  add("words after the end", text_ply + "the end\n");
  add("a zero byte after the end", text_ply + std::string(1, '\0'));
  add("the same file twice", text_ply + text_ply);

  const std::size_t header = binary_ply_header().size();
  const std::size_t faces = header + 4 * 3 * sizeof(float);
  const std::string good = binary_ply();
  for (const float value :
       {std::numeric_limits<float>::quiet_NaN(), -std::numeric_limits<float>::infinity(), 1e19f})
    add("binary: a coordinate is " + std::to_string(value), patched(good, header + 16, raw(value)));
  for (const int index : {4, -1, std::numeric_limits<int>::max(), std::numeric_limits<int>::min()})
    add("binary: index " + std::to_string(index), patched(good, faces + 18, raw(index)));
  for (const char corners : {'\0', '\1', '\2', '\xff'})
    add("binary: " + std::to_string(int{corners}) + " corners",
        patched(good, faces + 13, std::string(1, corners)));
  add("binary: a byte after the end", good + '\0');
  add("binary: a line end after the end", good + '\n');
  add("binary: cut in a vertex", good.substr(0, header + 17));
  add("binary: cut in a face", good.substr(0, good.size() - 1));
  add("binary: all body missing", good.substr(0, header));
  add("binary: the other byte order", replaced(good, "little", "big"));
  add("binary: called ascii", replaced(good, "binary_little_endian", "ascii"));
  add("text: called binary", replaced(text_ply, "ascii", "binary_little_endian"));
  add("binary: doubles promised, floats there", replaced_each(good, "float", "double"));
  add("binary: CRs put before its LFs, in the body too",
      binary_ply_header() +
          replaced_each(patched(good, header, raw(0x0a0a0a0a)), "\n", "\r\n").substr(header + 9));
  for (const char* count : {"5", "4294967300", "768614336404564651", "9223372036854775807"})
    add(std::string("binary: vertices ") + count,
        replaced(good, "vertex 4", std::string("vertex ") + count));
  for (const char* count : {"3", "5", "330382100", "1418980313362273202"})
    add(std::string("binary: faces ") + count,
        replaced(good, "face 4", std::string("face ") + count));
  const std::string listed =
      replaced(binary_ply_header(), "element face", "property list int double more\nelement face");
  for (const int count : {-1, 5, 536870912, std::numeric_limits<int>::max()})
    add("binary: a list to pass over has " + std::to_string(count),
        listed + ply_body().substr(0, 12) + raw(count) + ply_body().substr(12));
  add("binary: an element to pass over is huge",
      replaced(good, "element vertex",
               "element more 4611686018427387904\nproperty int i\n"
               "element vertex"));
  return files;
}

inline std::vector<DamagedMesh> damaged_obj() {
  std::vector<DamagedMesh> files;
  const auto add = [&](std::string what, std::string bytes) {
    files.push_back({Mesh::obj, std::move(what), std::move(bytes)});
  };
  const auto text = [&](std::string what, const std::string& from, const std::string& to) {
    add(std::move(what), replaced(text_obj, from, to));
  };
  add("empty file", "");
  add("only blank lines", "\n\n  \r\n");
  add("only a comment", "# nothing");
  add("zero bytes", std::string(5000, '\0'));
  add("UTF-16", std::string("\xff\xfev\0 \0000\0", 8));
  add("another format", text_ply);
  add("vertices only", text_obj.substr(0, text_obj.find('f')));
  add("faces only", text_obj.substr(text_obj.find('f')));
  for (const auto& [what, number] : bad_numbers)
    text(what, "v 2 0 0", "v " + std::string(number) + " 0 0");
  text("a weight that is nan", "v 2 0 0", "v 2 0 0 nan");
  text("a colour that is a word", "v 2 0 0", "v 2 0 0 1 0 red");
  text("a vertex of no numbers", "v 2 0 0", "v");
  text("a vertex of one number", "v 2 0 0", "v 2");
  text("a vertex of two numbers", "v 2 0 0", "v 2 0");
  text("a vertex of five numbers", "v 2 0 0", "v 2 0 0 1 1");
  text("a vertex of eight numbers", "v 2 0 0", "v 2 0 0 1 1 1 1 1");
  text("a vertex without v", "v 2 0 0", "2 0 0");
  text("two vertices in a line", "v 2 0 0\n", "v 2 0 0 ");
  text("a vertex too few", "v 2 0 0\n", "");
  for (const char* index : {"0",
                            "5",
                            "-5",
                            "-0",
                            "2147483648",
                            "-2147483649",
                            "4294967296",
                            "4294967298",
                            "18446744073709551617",
                            "-9223372036854775808",
                            "1.0",
                            "one",
                            "+-1",
                            "/1",
                            "1/2/3/4",
                            "1/x",
                            "1//x",
                            "1/2.5/3",
                            "1\\2",
                            "1;",
                            "//",
                            "nan"})
    text(std::string("corner ") + index, "f 1 3 2", std::string("f 1 3 ") + index);
  text("a face of two corners", "f 1 3 2", "f 1 3");
  text("a face of one corner", "f 1 3 2", "f 1");
  text("a face of no corners", "f 1 3 2", "f");
  text("a face that a comment ends", "f 1 3 2", "f 1 3 #2");
  text("a relative index before its vertex", "v 0 0 0", "f -1 -2 -3\nv 0 0 0");
  text("a face named F", "f 1 3 2", "F 1 3 2");
  text("an unknown statement", "f 1 3 2", "face 1 3 2");
  text("a word alone", "f 1 3 2", "f 1 3 2\ngarbage");
  text("a statement of bytes", "f 1 3 2", "\x01\xff\xfe 1 3 2");
  text("v and its number in one word", "v 2 0 0", "v2 0 0");
  text("a face whose line does not continue", "f 1 3 2", "f 1 3\n2");
  text("a face whose line continues into the next", "f 1 3 2", "f 1 3 2 \\");
  text("a backslash at the end of the file", "f 3 1 4\n", "f 3 1 \\");
  text("a free-form surface", "f 1 3 2", "cstype bezier\ndeg 1 1\nsurf 0 1 0 1 1 2 3 4\nend");
  text("a call of another file", "f 1 3 2", "call other.obj");
  add("cut in a face", text_obj.substr(0, text_obj.size() - 3));
  add("cut in a statement", text_obj + "ver");
  return files;
}

inline std::vector<DamagedMesh> damaged_stl() {
  std::vector<DamagedMesh> files;
  const auto add = [&](std::string what, std::string bytes) {
    files.push_back({Mesh::stl, std::move(what), std::move(bytes)});
  };
  const std::string good_text = text_stl(), good = binary_stl();
  const auto text = [&](std::string what, const std::string& from, const std::string& to) {
    add(std::move(what), replaced(good_text, from, to));
  };
  add("empty file", "");
  add("one byte", "s");
  add("only solid", "solid");
  add("a solid without end", "solid a\n");
  add("a solid without facets", "solid a\nendsolid a\n");
  add("zero bytes", std::string(5000, '\0'));
  add("84 zero bytes", std::string(84, '\0'));
  add("another format", text_obj);
  text("no solid", "solid\n", "");
  text("solid misspelt", "solid\n", "sold\n");
  text("no facet", " facet", "");
  text("facet misspelt", "facet", "face");
  text("no normal", "normal", "");
  text("a normal of two numbers", "normal 0 0 1", "normal 0 0");
  text("a normal of four numbers", "normal 0 0 1", "normal 0 0 1 1");
  text("a normal in words", "normal 0 0 1", "normal up up up");
  text("no outer", "outer ", "");
  text("no loop", "loop\n", "\n");
  text("no endloop", "  endloop\n", "");
  text("no endfacet", " endfacet\n", "");
  text("no endsolid", "endsolid\n", "");
  text("endsolid too early", " facet", "endsolid\n facet");
  text("a facet in a facet", "  outer", " facet normal 0 0 1\n  outer");
  text("two corners", "   vertex 0 3 0\n", "");
  text("four corners", "   vertex 0 3 0\n", "   vertex 0 3 0\n   vertex 2 3 0\n");
  text("a corner of two numbers", "vertex 0 3 0", "vertex 0 3");
  text("a corner of four numbers", "vertex 0 3 0", "vertex 0 3 0 1");
  text("a corner without vertex", "vertex 0 3 0", "0 3 0");
  for (const auto& [what, number] : bad_numbers)
    text(what, "vertex 2 0 0", "vertex " + std::string(number) + " 0 0");
  add("words after the end", good_text + "the end\n");
  add("a zero byte after the end", good_text + std::string(1, '\0'));
  add("text: cut in a facet", good_text.substr(0, good_text.size() / 2));
  add("text: cut in endsolid", good_text.substr(0, good_text.size() - 4));

  for (const std::uint32_t facets : {0u, 3u, 5u, 0x80000000u, 0xffffffffu, 85899346u})
    add("binary: facets " + std::to_string(facets), patched(good, 80, raw(facets)));
  add("binary: no facet", good.substr(0, 80) + raw(0u));
  add("binary: solid, and a facet too many",
      patched(binary_stl("solid a"), 80, raw(std::uint32_t{5})));
  add("binary: the count in the other order", patched(good, 80, raw(std::uint32_t{4}, true)));
  add("binary: a byte after the end", good + '\0');
  add("binary: a line end after the end", good + '\n');
  add("binary: a byte missing", good.substr(0, good.size() - 1));
  add("binary: a facet missing", good.substr(0, good.size() - 50));
  add("binary: cut in the header", good.substr(0, 79));
  add("binary: cut in the count", good.substr(0, 83));
  add("binary: cut after the count", good.substr(0, 84));
  for (const float value : {std::numeric_limits<float>::quiet_NaN(),
                            std::numeric_limits<float>::infinity(), 1e38f, -1e19f})
    for (const std::size_t corner : {0u, 2u})
      add("binary: a coordinate is " + std::to_string(value),
          patched(good, 84 + 50 + 12 + 12 * corner + 4, raw(value)));
  return files;
}

inline std::vector<DamagedMesh> damaged_off() {
  std::vector<DamagedMesh> files;
  const auto add = [&](std::string what, std::string bytes) {
    files.push_back({Mesh::off, std::move(what), std::move(bytes)});
  };
  const auto text = [&](std::string what, const std::string& from, const std::string& to) {
    add(std::move(what), replaced(text_off, from, to));
  };
  add("empty file", "");
  add("only OFF", "OFF\n");
  add("only a comment", "# OFF\n");
  add("zero bytes", std::string(5000, '\0'));
  add("another format", text_obj);
  text("no OFF", "OFF\n", "");
  text("OFF misspelt", "OFF", "OOF");
  text("off in small letters", "OFF", "off");
  text("OFF twice", "OFF", "OFF OFF");
  text("four dimensions", "OFF", "4OFF");
  text("n dimensions", "OFF", "nOFF\n3");
  text("colours twice", "OFF", "CCOFF");
  text("binary", "OFF", "OFF BINARY");
  text("colours promised, none there", "OFF", "COFF");
  text("normals promised, none there", "OFF", "NOFF");
  text("texture promised, none there", "OFF", "STOFF");
  text("no counts", "4 4 6\n", "");
  text("one count", "4 4 6", "4");
  text("two counts", "4 4 6", "4 4");
  text("four counts", "4 4 6", "4 4 6 1");
  text("a negative count of vertices", "4 4 6", "-4 4 6");
  text("a negative count of faces", "4 4 6", "4 -4 6");
  text("a count with a point", "4 4 6", "4.0 4 6");
  text("a count in words", "4 4 6", "four 4 6");
  text("no faces", "4 4 6", "4 0 6");
  text("no vertices", "4 4 6", "0 4 6");
  for (const char* count :
       {"5", "3", "100000000", "4294967300", "9223372036854775807", "99999999999999999999"}) {
    text(std::string("vertices ") + count, "4 4 6", std::string(count) + " 4 6");
    text(std::string("faces ") + count, "4 4 6", std::string("4 ") + count + " 6");
  }
  for (const auto& [what, number] : bad_numbers)
    text(what, "\n2 0 0", "\n" + std::string(number) + " 0 0");
  text("a short vertex", "2 0 0\n", "2 0\n");
  text("a long vertex", "2 0 0\n", "2 0 0 0\n");
  text("a short face", "3 1 2 3", "3 1 2");
  text("a face with two numbers more", "3 1 2 3", "3 1 2 3 0 1");
  text("a face with five numbers more", "3 1 2 3", "3 1 2 3 0 1 0 1 0");
  text("a face with a word more", "3 1 2 3", "3 1 2 3 red");
  text("a face of two corners", "3 1 2 3", "2 1 2");
  text("a face of one corner", "3 1 2 3", "1 1");
  text("a face of no corners", "3 1 2 3", "0");
  text("a face of -3 corners", "3 1 2 3", "-3 1 2 3");
  text("a face of 1e12 corners", "3 1 2 3", "1000000000000 1 2 3");
  for (const char* index :
       {"4", "-1", "2147483648", "4294967296", "4294967298", "18446744073709551617", "1.0", "one"})
    text(std::string("index ") + index, "3 1 2 3", std::string("3 1 ") + index + " 3");
  add("words after the end", text_off + "the end\n");
  add("a zero byte after the end", text_off + std::string(1, '\0'));
  add("the same file twice", text_off + text_off);
  add("cut in a face", text_off.substr(0, text_off.size() - 3));
  add("cut in the vertices", text_off.substr(0, 20));
  return files;
}

inline std::vector<DamagedMesh> damaged_meshes() {
  std::vector<DamagedMesh> all;
  for (const auto& files : {damaged_ply(), damaged_obj(), damaged_stl(), damaged_off()})
    all.insert(all.end(), files.begin(), files.end());
  return all;
}

}  // namespace ensonify::tests
