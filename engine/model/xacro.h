#pragma once
// Files for xacro, a program of ROS that writes URDF from macros.

#include <tinyxml2.h>

#include <optional>
#include <string>

#include "engine/settings/program.h"

namespace graze {

/// Where a document needs xacro.
struct XacroUse {
  int line;
  std::string what;  // "<xacro:macro>", "'${r}'"
  bool element;      // an element of xacro, which no reader of URDF may pass over; else an expression in an attribute
};

/// The first of them, or nothing: elements of xacro anywhere but in what it printed itself, and expressions in
/// attributes of links and joints. What is declared and not used (`xmlns:xacro`) is none, since expanded files keep it.
std::optional<XacroUse> xacro_use(const tinyxml2::XMLDocument& document);

/// Whether its name is <xacro:…>.
bool is_of_xacro(const tinyxml2::XMLElement& e);

/// Whether a comment before the robot says so. Releases of xacro up to that of ROS Kinetic leave calls of macros that
/// nothing defines in what they print.
bool is_printed_by_xacro(const tinyxml2::XMLDocument& document);

/// The command that makes a URDF of a xacro file: "xacro r.urdf.xacro > r.urdf".
std::string xacro_command(const std::string& file);

/// How to come to a URDF from a file, or output of xacro, in which there is xacro: "expand it first: xacro …".
std::string xacro_advice(const std::string& name);

/// What an expanded file is called in messages: "r.urdf.xacro (expanded by xacro)".
std::string expanded_name(const std::string& file);

/// A xacro process may take a minute (one that includes hundreds of files takes seconds) and print as much as a URDF
/// file may have.
ProgramLimits xacro_limits();

/// What the program `xacro` on PATH makes of a file, whose content is `text`; nothing if there is no such program.
/// It is run once for each content while this process lives; campaigns keep what it printed, and a replay takes that.
/// Throws InputError if it fails, with its own words.
std::optional<std::string> expanded_by_xacro(const std::string& file, const std::string& text,
                                             const ProgramLimits& limits = xacro_limits());

}  // namespace graze
