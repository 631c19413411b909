"""Writes the pages of the reference that follow from the program and from the headers.

Usage: generated_pages.py PROGRAM DOXYGEN_XML FOLDER. The pages in doc/reference include the files that this
writes into FOLDER.
"""

import pathlib
import re
import subprocess
import sys
import xml.etree.ElementTree as ElementTree


def output_of(program, *arguments):
    return subprocess.run([program, *arguments], check=True, capture_output=True, text=True).stdout


def scene_keys(program):
    """`ensonify schema` is Markdown with a title; the page has its own."""
    return output_of(program, "schema").split("\n", 1)[1]


def commands(program):
    """The help of each subcommand, under a heading."""
    overview = output_of(program, "--help")
    names = re.findall(r"^  ([a-z][a-z-]*) ", overview.split("Subcommands:")[1], re.MULTILINE)
    return "".join(f"## ensonify {name}\n\n```text\n{output_of(program, name, '--help').rstrip()}\n```\n\n"
                   for name in names)


def members_by_header(xml):
    """The directives of functions, enumerations and aliases, which Doxygen lists by namespace."""
    found = {}
    for namespace in sorted(xml.glob("namespaceensonify*.xml")):
        for member in ElementTree.parse(namespace).getroot().iter("memberdef"):
            kind, name = member.get("kind"), member.findtext("qualifiedname")
            if member.findtext("type") == "decltype(auto)":
                continue  # Breathe does not find such functions
            if kind == "function":
                directive = f"```{{doxygenfunction}} {name}{member.findtext('argsstring')}\n```"
            elif kind in ("enum", "typedef", "variable"):
                directive = f"```{{doxygen{kind}}} {name}\n```"
            else:
                continue
            found.setdefault(member.find("location").get("file"), []).append(directive)
    return found


def cpp(xml):
    """The types and functions of each installed header, for Breathe."""
    page, members = [], members_by_header(xml)
    for entry in sorted(xml.glob("*_8h.xml")):
        header = ElementTree.parse(entry).getroot().find("compounddef")
        path = header.find("location").get("file")
        directives = [f"```{{doxygen{kind.get('refid')[:kind.get('refid').index('ensonify')]}}} {kind.text}\n"
                      ":members:\n```" for kind in header.findall("innerclass")
                      if kind.get("prot") == "public" and kind.text.count("::") == 2]
        directives += members.get(path, [])
        if directives:
            page.append((path, f"## {path}\n\n" + "\n\n".join(directives) + "\n\n"))
    return "".join(text for _, text in sorted(page))


def main():
    program, xml, folder = sys.argv[1], pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3])
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "scene_keys.md").write_text(scene_keys(program))
    (folder / "recipe.toml").write_text(output_of(program, "dump-default", "generate"))
    (folder / "commands.md").write_text(commands(program))
    (folder / "cpp.md").write_text(cpp(xml))


if __name__ == "__main__":
    main()
