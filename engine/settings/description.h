#pragma once
// What a component (policy, tracker, witness, distribution, shape) or a section of a scenario tells of itself: its
// keys, how each is written, what it is by default, and a line of help. It stands once, in the component's own file;
// from it come the check of unknown keys, the defaults that readers use, `graze help`, the JSON Schema and the tables
// of docs/. In lines of help, what is typed literally stands `in backquotes`.

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/settings/settings.h"

namespace graze {

struct Description;

/// What a number must keep to.
enum class Bound { none, positive, not_negative, fraction /* within 0 and 1 */, correlation /* within -1 and 1 */ };

/// One way to write a value.
struct Form {
  enum class Kind {
    number,         // of `quantity`
    numbers,        // list of `count` of them
    rows,           // list of such lists
    joint_numbers,  // one number for all joints, or a map of joint globs to numbers
    drawn,          // number in the unit of the parameter that is drawn
    drawn_list,     // list of `count` of them
    width,          // the same, or % of the nominal value; not negative
    labels,         // list of numbers or words
    spread,         // a distribution, or jitter
    whole,          // whole number
    flag,           // true or false
    word,           // one of `words`
    text,           // `what` says of what
    texts,          // list of `count` of them
    text_rows,      // list of such lists
    named_numbers,  // map of globs of `what` to numbers
    named_values,   // map of names of `what` to whatever the user's own code takes
    section,        // of the scenario, which `what` names
    sections,       // list of `count` of them
    map,            // described by `inner`
    maps,           // list of them
    nothing         // no value at all
  };
  Kind kind = Kind::text;
  Quantity quantity = Quantity::dimensionless;
  std::optional<Quantity> other;  // numbers: what some of them are of, which have no unit in common then
  Bound bound = Bound::none;
  int count = -1;                  // of a list; -1: any
  std::vector<std::string> words;  // of a section: how tables tell it
  std::string what;                // "FILE", "GLOB"
  std::shared_ptr<const Description> inner;

  static Form number(Quantity quantity = Quantity::dimensionless, Bound bound = Bound::none);
  static Form fraction() { return number(Quantity::dimensionless, Bound::fraction); }
  static Form numbers(int count, Quantity quantity = Quantity::dimensionless, Bound bound = Bound::none);
  static Form mixed_numbers(int count, Quantity one, Quantity other);
  static Form rows(int count, Quantity quantity = Quantity::dimensionless);
  static Form joint_numbers(Quantity quantity, Bound bound = Bound::none);
  static Form drawn() { return of(Kind::drawn); }
  static Form drawn_list(int count);
  static Form width() { return of(Kind::width); }
  static Form labels() { return of(Kind::labels); }
  static Form spread() { return of(Kind::spread); }
  static Form whole(Bound bound = Bound::none);
  static Form flag() { return of(Kind::flag); }
  static Form word(std::vector<std::string> words);
  static Form text(std::string what);
  static Form texts(int count, std::string what);
  static Form text_rows(int count, std::string what);
  static Form named_numbers(std::string what);
  static Form named_values(std::string what);
  static Form section(std::string name, std::string told = "map");
  static Form sections(int count, std::string name, std::string told);
  static Form map(Description inner);
  static Form maps(Description inner);
  static Form nothing() { return of(Kind::nothing); }
  static Form of(Kind kind);

  // Out of line, as those of the types below: GCC 12 warns of strings in initializer lists that it inlines.
  Form();
  Form(const Form&);
  Form(Form&&) noexcept;
  Form& operator=(const Form&);
  Form& operator=(Form&&) noexcept;
  ~Form();
};

/// What stands for a key that is not written.
struct Default {
  enum class Kind { none, required, value, words };
  Kind kind = Kind::none;
  std::string text;

  static Default required();
  /// As it would be written, "75 %": this is what readers take.
  static Default value(std::string text);
  /// In words, where it depends on other things: "2 % of the robot's weight".
  static Default words(std::string text);

  Default();
  Default(const Default&);
  Default(Default&&) noexcept;
  Default& operator=(const Default&);
  Default& operator=(Default&&) noexcept;
  ~Default();
};

struct Key {
  std::string name;
  std::vector<Form> forms;  // one of them; the usual one first
  Default otherwise;
  std::string help;  // what it is, in one line
  std::string with;  // the key that it goes with, and without which it is refused

  Key(std::string name, std::vector<Form> forms, Default otherwise = {}, std::string help = {}, std::string with = {});
  Key(const Key&);
  Key(Key&&) noexcept;
  Key& operator=(const Key&);
  Key& operator=(Key&&) noexcept;
  ~Key();
};

struct Description {
  std::string help;                              // what it is, in one line
  std::vector<Key> keys;                         // in the order in which they are told
  std::vector<std::vector<std::string>> one_of;  // groups of keys of which exactly one is written
  std::vector<Form> instead;                     // what may stand in the map's place; without keys: what must
  std::string more;                              // what else must be known, in one paragraph

  Description(std::string help, std::vector<Key> keys = {}, std::vector<std::vector<std::string>> one_of = {},
              std::vector<Form> instead = {}, std::string more = {});
  Description(const Description&);
  Description(Description&&) noexcept;
  Description& operator=(const Description&);
  Description& operator=(Description&&) noexcept;
  ~Description();

  std::vector<std::string> names() const;  // of the keys
  const Key* find(std::string_view name) const;
  /// True if a map without any key is right.
  bool may_be_empty() const;
};

/// How a value is written, for tables: "m, > 0", "3 numbers, m", "linear, cubic".
std::string value_text(const Key& key);
std::string value_text(const Form& form);
/// What stands for a key that is not written, for tables: "75 %", "required", "this or waypoints"; or empty.
std::string default_text(const Description& description, const Key& key);
/// The keys with those of inner maps behind them, by path: "stance", "stance.length".
struct KeyRow {
  std::string path;
  const Description* description;
  const Key* key;
};
std::vector<KeyRow> key_rows(const Description& description);
/// Without the backquotes.
std::string plain(std::string_view text);

/// A settings map with its description: what is not written has the default that is told.
class Described {
 public:
  /// Refuses keys that are not described, with the nearest, those that lack the key that they go with, groups of which
  /// none or several are written (Description::one_of), and what is no map unless something may stand in its place,
  /// which is the reader's to check. `description` outlives this.
  Described(const Settings& settings, const Description& description);

  bool has(std::string_view key) const { return settings_.has(key); }
  std::optional<Settings> find(std::string_view key) const;
  Settings at(std::string_view key) const;
  const Settings& settings() const { return settings_; }

  /// Written or by default, SI; checked by its bound. Only for keys that are required or have a default value.
  double number(std::string_view key) const;
  bool flag(std::string_view key) const;
  std::string word(std::string_view key) const;
  /// Nothing if it is not written and has no default value.
  std::optional<double> find_number(std::string_view key) const;
  /// The default value and the quantity of a number, or of numbers by joint. A required key has none: says that it is
  /// missing.
  double default_number(std::string_view key) const;
  Quantity quantity(std::string_view key) const;

 private:
  const Key& key_of(std::string_view name) const;

  Settings settings_;
  const Description* description_;
};

}  // namespace graze
