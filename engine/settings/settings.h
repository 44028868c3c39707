#pragma once
// A cursor over a settings tree (YAML) that knows where it stands: every value that is read is checked on the spot, and
// every complaint names file:line:column, the value, the rule and the nearest right answer. Scenario files, policies,
// trackers and witnesses are all read through it. In: YAML text. Out: typed values or InputError.

#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "engine/settings/nul.h"

namespace graze {

/// A user's mistake in some input. what() is the whole message: "file:line:column: path: value: rule; suggestion".
/// The command line turns it into exit code 2.
class InputError : public std::runtime_error {
 public:
  /// A NUL in the message is shown as \0: what() would end there.
  explicit InputError(const std::string& message) : std::runtime_error(with_nul_shown(message)) {}
};

/// The machine failed, or the campaign is not complete. Exit code 3. what() is the whole message.
class MachineError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// What a number measures; decides which units may be written behind it. The value read is always SI (rad for angles).
enum class Quantity {
  dimensionless,         // also "%"
  length,                // m, cm, mm, in
  angle,                 // rad, deg
  time,                  // s, ms, us
  mass,                  // kg, g
  density,               // kg/m^3, g/cm^3
  velocity,              // m/s, cm/s, mm/s
  angular_velocity,      // rad/s, deg/s, rpm
  acceleration,          // m/s^2
  angular_acceleration,  // rad/s^2
  force,                 // N
  impulse,               // N s, mN s
  torque,                // N m (also "Nm")
  stiffness,             // N/m
  rotational_stiffness,  // N m/rad
  damping,               // N s/m
  rotational_damping,    // N m s/rad
  inertia,               // kg m^2, kg cm^2, g cm^2
};

/// The SI unit as written in tables and archives, e.g. "kg/m^3"; "1" for dimensionless.
std::string_view unit_of(Quantity quantity);

/// The candidate nearest to `word` by edit distance, or empty when none is near.
std::string nearest(std::string_view word, const std::vector<std::string>& candidates);

/// What to say of a word or glob that is none of `names`: "nearest: still", or, if none is near, "there are: still,
/// walk".
std::string nearest_or_all(std::string_view word, const std::vector<std::string>& names);

/// `text`, or its first `most` bytes or a little less and "…": for messages.
std::string clipped(std::string_view text, std::size_t most);

/// True if `name` matches the glob `pattern` (`*`, `?`, `{a,b}`). Throws InputError if its braces stand for too many
/// patterns (kMaxAlternatives).
bool matches(std::string_view pattern, std::string_view name);

/// `--set path=value`, as given on the command line.
struct Override {
  std::string path;   // "time.end", "robot.urdf", "policies.step.gait.step_height"
  std::string value;  // YAML text
};

struct SettingsNode;  // engine/settings/tree.h

class Settings {
 public:
  /// Reads a YAML file, "-": standard input. A key `include: other.yaml` (or a list) anywhere in a map merges that
  /// file's map under it, keys of the including map winning (maps on both sides are merged in turn, unless the
  /// including one is tagged `!replace`; `key: ~` takes a key out); paths are relative to the including file. Overrides
  /// are applied last and make the maps that are missing on their way. Throws InputError, and nothing else, for any
  /// bytes.
  static Settings load(const std::string& file, const std::vector<Override>& overrides = {});
  /// The same from text; `name` stands for the file in messages.
  static Settings parse(const std::string& text, const std::string& name);
  /// With overrides applied, as load() does.
  Settings overridden(const std::vector<Override>& overrides) const;

  /// Whole tree as YAML text after includes and overrides.
  std::string resolved_text() const;

  bool is_map() const;
  bool is_list() const;
  bool is_scalar() const;
  /// A scalar that was written in quotes or as a block: a text, whatever it looks like.
  bool is_quoted() const;
  bool is_null() const;

  // ---- maps
  bool has(std::string_view key) const;
  Settings at(std::string_view key) const;  // missing key: InputError naming the key and this place
  std::optional<Settings> find(std::string_view key) const;
  /// Entries in file order. The key's own place is `.key_place()` of the value.
  std::vector<std::pair<std::string, Settings>> entries() const;
  /// Refuses any key that is not listed, with the nearest listed one.
  void allow(const std::vector<std::string>& keys) const;
  /// The one key of a one-entry map such as `{uniform: [1, 2]}`; else InputError that lists `choices`.
  std::pair<std::string, Settings> single(const std::vector<std::string>& choices) const;

  // ---- lists
  std::vector<Settings> items() const;  // a scalar counts as a list of one

  // ---- changed copies (the tree itself never changes)
  /// With `value` at `path` below this place, resolved as for --set. `value` keeps its own place.
  Settings with(const std::string& path, const Settings& value) const;
  /// This map without `key`.
  Settings without(std::string_view key) const;

  // ---- values
  double number(Quantity quantity = Quantity::dimensionless) const;  // "2.5 mm" with length gives 0.0025
  double positive(Quantity quantity = Quantity::dimensionless) const;
  double non_negative(Quantity quantity = Quantity::dimensionless) const;
  double within(double low, double high, Quantity quantity = Quantity::dimensionless) const;  // closed interval
  long long integer() const;
  bool flag() const;
  std::string text() const;
  /// A text that will serve as a glob: one that is too long, or stands for too many patterns, is refused.
  std::string glob() const;
  /// One of `choices`, with the nearest named in the error.
  std::string choice(const std::vector<std::string>& choices) const;
  /// A list of exactly n numbers (n < 0: any). A trailing unit for all may stand as last item: `[25, 75, 0, 50, "%"]`,
  /// or behind the list when the whole is written as a string: "[25, 75, 0, 50] %".
  std::vector<double> numbers(int n, Quantity quantity = Quantity::dimensionless) const;

  // shorthand: value of `key` or the default
  double number_or(std::string_view key, double fallback, Quantity quantity = Quantity::dimensionless) const;
  bool flag_or(std::string_view key, bool fallback) const;
  std::string text_or(std::string_view key, std::string fallback) const;

  // ---- places
  std::string path() const;   // "policies.step.gait.velocity"
  std::string place() const;  // "curb.yaml:31:7"
  std::string key_place() const;
  std::string file() const;  // file the value came from; relative names in it are relative to its folder
  /// `value` as a path relative to the folder of the file that this value stands in.
  std::string resolve_file(const std::string& value) const;

  /// Throws InputError with "place: path: message".
  [[noreturn]] void fail(const std::string& message) const;
  /// The same at the place of key rather than of its value.
  [[noreturn]] void fail_key(const std::string& message) const;

 private:
  std::shared_ptr<const SettingsNode> node_;  // immutable, knows its places; built once from YAML
  std::string path_;

  Settings(std::shared_ptr<const SettingsNode> node, std::string path)
      : node_(std::move(node)), path_(std::move(path)) {}
  Settings child(const std::string& key, std::shared_ptr<const SettingsNode> node) const;
  void need_map() const;
  const std::string& scalar(const char* expected) const;
  double number_from(const std::string& text, Quantity quantity) const;
  std::string shown() const;  // the value as written, for messages
};

}  // namespace graze
