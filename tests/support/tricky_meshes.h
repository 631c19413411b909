#pragma once

#include <string>
#include <utility>
#include <vector>

#include "support/mesh_files.h"

namespace ensonify::tests {

inline const std::string byte_order_mark = "\xef\xbb\xbf";

/// Changes to a text file that do not change its content.
inline std::vector<std::pair<std::string, std::string>> respelt(const std::string& text) {
  return {{"CRLF", replaced_each(text, "\n", "\r\n")},
          {"lone CR", replaced_each(text, "\n", "\r")},
          {"byte-order mark", byte_order_mark + text},
          {"byte-order mark and CRLF", byte_order_mark + replaced_each(text, "\n", "\r\n")},
          {"spaces at line ends", replaced_each(text, "\n", "  \t\n")},
          {"tabs and many spaces", replaced_each(text, " ", " \t  ")},
          {"blank lines at the end", text + "\n\r\n \t\n"},
          {"no line end at the end", text.substr(0, text.size() - 1)}};
}

/// Other spellings of the numbers 2, 3 and 5, each of which occurs once as a coordinate.
inline std::vector<std::pair<std::string, std::string>> respelt_numbers(const std::string& text) {
  const auto with = [&](const std::string& two, const std::string& three, const std::string& five) {
    std::string other = replaced_each(text, "2 0 0\n", two + " 0 -0\n");
    other = replaced_each(other, "0 3 0\n", "0.0 " + three + " +0\n");
    return replaced_each(other, "0 0 5\n", "-0.0 .0 " + five + "\n");
  };
  return {{"a leading plus", with("+2", "+3.0", "+5.")},
          {"exponents", with("2e0", "0.3E1", "5000.0e-3")},
          {"no digit before the point", with(".2e+1", ".03e2", "+.5e1")},
          {"many digits", with("2.00000000000000000000000", "000000003",
                               "5.000000000000000000000000000000000000000000000000000000")},
          {"too small for a double", replaced_each(text, "0 3 0\n", "1e-400 3 -4.9e-324\n")}};
}

inline std::vector<TrickyMesh> tricky_ply() {
  std::vector<TrickyMesh> files;
  const auto add = [&](std::string what, std::string bytes, std::size_t vertices = 4,
                       std::size_t faces = 4) {
    files.push_back({Mesh::ply, std::move(what), std::move(bytes), vertices, faces});
  };
  const auto text = [&](std::string what, const std::string& from, const std::string& to) {
    add(std::move(what), replaced(text_ply, from, to));
  };
  for (const auto& [what, bytes] : respelt(text_ply)) add(what, bytes);
  for (const auto& [what, bytes] : respelt_numbers(text_ply)) add(what, bytes);
  text("comments", "element vertex",
       "comment element vertex 9\ncomment\nobj_info end_header\nelement vertex");
  std::string comments;
  for (int i = 0; i < 2000; ++i) comments += "comment a long header\n";
  text("a header of 40 kB", "element vertex", comments + "element vertex");
  text("vertex_index", "vertex_indices", "vertex_index");
  text("other counts and indices", "uchar int", "int8 uint32");
  text("blank lines between rows", "2 0 0\n", "\n2 0 0\n\n \n");
  text("a row in two lines", "2 0 0\n", "2 0\n0\n");
  add("an element without properties", replaced(text_ply, "element vertex",
                                                "element nothing 9000000000000000000\n"
                                                "element vertex"));
  add("faces before vertices",
      "ply\nformat ascii 1.0\nelement face 4\nproperty list uchar int vertex_indices\n"
      "element vertex 4\nproperty float x\nproperty float y\nproperty float z\nend_header\n" +
          face_lines + vertex_lines);
  add("coordinates in another order, and more",
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty float z\nproperty uchar red\n"
      "property list uchar int more\nproperty double x\nproperty float nx\nproperty int y\n"
      "element face 4\nproperty uchar flags\nproperty list uchar float texcoord\n"
      "property list uint ushort vertex_index\nproperty float quality\nend_header\n"
      "0 255 0 0 nan 0\n0 255 2 7 8 2 1 0\n0 1 1 9 0 0 3\n5 1 0 0 -nan 0\n"
      "1 0 3 0 2 1 0.5\n1 6 0 0 1 0 1 1 3 0 1 3 0.5\n1 0 3 1 2 3 0.5\n1 0 3 2 0 3 0.5\n");
  add("an element more before, between and after",
      "ply\nformat ascii 1.0\nelement camera 1\nproperty float fov\nelement vertex 4\n"
      "property float x\nproperty float y\nproperty float z\nelement edge 2\n"
      "property int vertex1\nproperty int vertex2\nelement face 4\n"
      "property list uchar int vertex_indices\nelement material 1\n"
      "property list int uchar name\nend_header\n0.7\n" +
          vertex_lines + "0 1\n1 2\n" + face_lines + "3 1 2 3\n");
  add("polygons",
      replaced(replaced(text_ply, "3 0 2 1\n", "4 0 2 1 0\n"), "3 1 2 3\n", "6 1 2 3 1 2 3\n"), 4,
      8);
  add("a vertex twice, and one that no face uses",
      replaced(replaced(text_ply, "vertex 4", "vertex 6"), "0 0 5\n", "0 0 5\n0 0 5\n9 9 9\n"), 6);

  for (const bool big : {false, true}) {
    const std::string order = big ? "big-endian" : "little-endian";
    const std::string header = binary_ply_header(big);
    const auto typed = [&](const std::string& coordinate, const std::string& list) {
      return replaced(replaced_each(header, "float", coordinate), "uchar int", list);
    };
    using std::int16_t, std::int8_t, std::uint16_t, std::uint32_t, std::uint8_t;
    add(order, binary_ply(big));
    add(order + " after CRLF", replaced_each(header, "\n", "\r\n") + ply_body(big));
    add(order + " after lone CR", replaced_each(header, "\n", "\r") + ply_body(big));
    add(order + " double", typed("double", "uint int") + ply_body<double, uint32_t>(big));
    add(order + " char", typed("char", "char char") + ply_body<int8_t, int8_t, int8_t>(big));
    add(order + " uint8", typed("uint8", "uint8 uint8") + ply_body<uint8_t, uint8_t, uint8_t>(big));
    add(order + " short", typed("short", "int16 short") + ply_body<int16_t, int16_t, int16_t>(big));
    add(order + " ushort",
        typed("ushort", "ushort uint16") + ply_body<uint16_t, uint16_t, uint16_t>(big));
    add(order + " int", typed("int", "int int32") + ply_body<int, int, int>(big));
    add(order + " uint",
        typed("uint32", "uint uint") + ply_body<uint32_t, uint32_t, uint32_t>(big));
    add(order + " after a list and another element",
        replaced(header, "element vertex",
                 "element more 2\nproperty list short double numbers\nproperty uchar u\n"
                 "element vertex") +
            raw(int16_t{2}, big) + raw(1.0) + raw(2.0) + '\7' + raw(int16_t{0}, big) + '\7' +
            ply_body(big));
  }
  // The body begins with an LF: after a lone CR it is not part of the line end.
  std::string body = ply_body();
  body.replace(0, 1, "\n");  // 1.4e-44: 0 unless the reader removes that byte
  add("lone CR before a body that begins with LF",
      replaced_each(binary_ply_header(), "\n", "\r") + body);
  return files;
}

inline std::vector<TrickyMesh> tricky_obj() {
  std::vector<TrickyMesh> files;
  const auto add = [&](std::string what, std::string bytes, std::size_t vertices = 4,
                       std::size_t faces = 4) {
    files.push_back({Mesh::obj, std::move(what), std::move(bytes), vertices, faces});
  };
  const auto text = [&](std::string what, const std::string& from, const std::string& to) {
    add(std::move(what), replaced(text_obj, from, to));
  };
  for (const auto& [what, bytes] : respelt(text_obj)) add(what, bytes);
  for (const auto& [what, bytes] : respelt_numbers(text_obj)) add(what, bytes);
  text("comments", "v 2 0 0\n", "# v 9 9 9\n#\nv 2 0 0 # 9\nv 0 3 0#\n#v 9 9 9");
  files.back().bytes = replaced(text_obj, "v 2 0 0\n", "# v 9 9 9 \\\n#\nv 2 0 0 # 9 \\\n#v 9\n");
  text("a comment without line end", "f 3 1 4\n", "f 3 1 4#");
  text("blank lines and indents", "v 2 0 0\n", "\n\n  \n\t v 2 0 0\n\n");
  text("weights", "v 2 0 0", "v 2 0 0 1.0");
  text("colours", "v 2 0 0", "v 2 0 0 0.5 1 0.25");
  text("a weight and a colour", "v 2 0 0", "v 2 0 0 1 0.5 1 0.25");
  text("texture", "f 1 3 2", "vt 0 1\nvt 1 1 0\nf 1/1 3/2 2/2");
  text("normals", "f 1 3 2", "vn 0 0 nan\nf 1//1 3//1 2//1");
  text("texture and normals", "f 1 3 2", "vt 0\nvn 0 0 1\nf 1/1/1 3/1/-1 2/-1/1");
  text("slashes with nothing after them", "f 1 3 2", "f 1// 3/ 2//");
  text("relative indices", "f 1 3 2", "f -4 -2 -3");
  text("relative indices and texture", "f 1 3 2", "vt 0 0\nf -4/-1 -2/-1 -3/-1");
  text("a plus before an index", "f 1 3 2", "f +1 +3 +2");
  text("zeros before an index", "f 1 3 2", "f 001 03 0000000000000000000002");
  text("a line that continues", "f 1 3 2", "f 1 \\\n 3\\\r\n  2");
  text("a vertex that continues", "v 2 0 0", "v \\\n 2 \\  \n 0\\\n 0");
  text("a group that continues", "f 1 3 2", "g one two \\\nf three\nf 1 3 2");
  text("the old name of a face", "f 1 3 2", "fo 1 3 2");
  text("points and lines", "f 1 3 2", "p 1 2\nl 1 2 3\nl 1/1 2/1\nf 1 3 2");
  text("materials, groups, names", "f 1 3 2",
       "mtllib C:\\a b\\c.mtl\nusemtl red\no name\ng a b c\ng\ns off\ns 1\nlod 1\nf 1 3 2");
  add("faces before vertices",
      text_obj.substr(text_obj.find('f')) + text_obj.substr(0, text_obj.find('f')));
  add("relative indices between vertices",
      "v 0 0 0\nv 2 0 0\nv 0 3 0\nf -3 -1 -2\nv 0 0 5\nf -4 -3 -1\nf -3 -2 -1\nf -2 -4 -1\n");
  add("polygons", replaced(replaced(text_obj, "f 1 3 2", "f 1 3 2 1"), "f 2 3 4", "f 2 3 4 2 3 4"),
      4, 8);
  add("a vertex twice, and one that no face uses",
      replaced(text_obj, "f 1 3 2", "v 0 0 5\nv 9 9 9\nf 1 3 2"), 6);
  add("a corner twice in a face", replaced(text_obj, "f 1 3 2\n", "f 1 3 2\nf 1 1 2\n"), 4, 5);
  add("a face twice", text_obj + "f 3 1 4\n", 4, 5);
  return files;
}

inline std::vector<TrickyMesh> tricky_stl() {
  std::vector<TrickyMesh> files;
  const auto add = [&](std::string what, std::string bytes, std::size_t vertices = 4,
                       std::size_t faces = 4) {
    files.push_back({Mesh::stl, std::move(what), std::move(bytes), vertices, faces});
  };
  const std::string good = text_stl();
  const auto text = [&](std::string what, const std::string& from, const std::string& to) {
    add(std::move(what), replaced(good, from, to));
  };
  for (const auto& [what, bytes] : respelt(good)) add(what, bytes);
  for (const auto& [what, bytes] : respelt_numbers(good)) add(what, bytes);
  text("a name", "solid\n", "solid facet vertex 9 9 9\n");
  text("a name in bytes", "solid\n", "solid \xff\xfe\x01 \\\n");
  add("a name at the end", replaced(good, "endsolid\n", "endsolid another name\n"));
  text("normals that are nan", "normal 0 0 1", "normal nan -nan(ind) NAN");
  text("normals that are nought", "normal 0 0 1", "normal 0 0 -0");
  text("a blank line first", "solid", "\n \nsolid");
  add("capitals",
      replaced_each(replaced_each(replaced_each(good, "facet", "FACET"), "vertex", "Vertex"),
                    "solid", "SOLID"));
  add("one facet a line",
      "solid\n" + replaced_each(good.substr(6, good.size() - 15), "\n", " ") + "\nendsolid\n");
  add("a word a line", "solid\n" + replaced_each(good.substr(6), " ", "\n"));
  add("two solids", good + good, 4, 8);
  add("an empty solid, and another", "solid empty\nendsolid empty\n" + good);

  add("binary", binary_stl());
  add("binary that begins with solid", binary_stl("solid facet normal"));
  add("binary that begins with solid and lines", binary_stl("solid a\n facet normal 0 0 1\n"));
  add("binary with a header of zeros", binary_stl(std::string(80, '\0')));
  add("binary after solid and zeros", binary_stl(std::string("solid\0", 6)));
  add("binary that begins with a byte-order mark", binary_stl(byte_order_mark + "solid"));
  std::string attributes = binary_stl();
  for (std::size_t i = 0; i < 4; ++i) attributes.replace(84 + 50 * i + 48, 2, "\xff\xff");
  add("binary with attributes", attributes);
  std::string normals = binary_stl();
  for (std::size_t i = 0; i < 4; ++i) normals.replace(84 + 50 * i, 12, std::string(12, '\xff'));
  add("binary with normals that are nan", normals);
  std::string zeros = binary_stl();
  zeros.replace(84 + 50 + 12, 4, raw(-0.0f));
  add("binary with a corner at -0", zeros);
  std::string repeated = binary_stl();
  repeated.replace(80, 4, raw(std::uint32_t{5}));
  add("binary with a facet twice", repeated + repeated.substr(84, 50), 4, 5);
  return files;
}

inline std::vector<TrickyMesh> tricky_off() {
  std::vector<TrickyMesh> files;
  const auto add = [&](std::string what, std::string bytes, std::size_t vertices = 4,
                       std::size_t faces = 4) {
    files.push_back({Mesh::off, std::move(what), std::move(bytes), vertices, faces});
  };
  const auto text = [&](std::string what, const std::string& from, const std::string& to) {
    add(std::move(what), replaced(text_off, from, to));
  };
  const auto each_vertex = [](const std::string& header, const std::string& more) {
    return header + "\n4 4 6\n" + replaced_each(vertex_lines, "\n", " " + more + "\n") + face_lines;
  };
  for (const auto& [what, bytes] : respelt(text_off)) add(what, bytes);
  for (const auto& [what, bytes] : respelt_numbers(text_off)) add(what, bytes);
  text("counts in the first line", "OFF\n", "OFF ");
  text("counts in three lines", "4 4 6", "4\n4\n6");
  text("a wrong count of edges", "4 4 6", "4 4 0");
  text("comments", "2 0 0\n", "# 9 9 9\n#\n2 0 0 # 9\n");
  text("comments before everything", "OFF", "# a comment\n\nOFF# another\n# and");
  text("a comment without line end", "3 2 0 3\n", "3 2 0 3#");
  text("blank lines", "2 0 0\n", "\n2 0 0\n \n");
  text("a vertex in two lines", "2 0 0\n", "2\n0 0\n");
  text("an index as colour", "3 1 2 3", "3 1 2 3 7");
  text("a colour", "3 1 2 3", "3 1 2 3 255 0 0");
  text("a colour with alpha", "3 1 2 3", "3 1 2 3 0.5 0.5 0 1.0");
  add("vertices with colours", each_vertex("COFF", "255 0 0"));
  add("vertices with colours and alpha", each_vertex("COFF", "1.0 0.5 0 1"));
  add("vertices with normals", each_vertex("NOFF", "0 nan 1"));
  add("vertices with texture", each_vertex("STOFF", "0.5 1"));
  add("vertices with normals and colours", each_vertex("CNOFF", "0 0 1 255 0 0 255"));
  add("vertices with everything", each_vertex("STCNOFF", "0 0 1 255 0 0 0.5 0.5"));
  add("vertices with everything, counts in the first line",
      replaced(each_vertex("STCNOFF", "0 0 1 255 0 0 255 0.5 0.5"), "OFF\n", "OFF "));
  add("polygons",
      replaced(replaced(text_off, "3 0 2 1\n", "4 0 2 1 0\n"), "3 1 2 3\n", "6 1 2 3 1 2 3\n"), 4,
      8);
  add("a vertex twice, and one that no face uses",
      replaced(replaced(text_off, "4 4 6", "6 4 6"), "0 0 5\n", "0 0 5\n0 0 5\n9 9 9\n"), 6);
  return files;
}

inline std::vector<TrickyMesh> tricky_meshes() {
  std::vector<TrickyMesh> all;
  for (const auto& files : {tricky_ply(), tricky_obj(), tricky_stl(), tricky_off()})
    all.insert(all.end(), files.begin(), files.end());
  return all;
}

}  // namespace ensonify::tests
