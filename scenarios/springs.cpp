#include "scenarios/springs.h"

#include <fmt/format.h>

#include <vector>

#include "engine/model/limits.h"
#include "engine/settings/warnings.h"

namespace graze {
namespace {

class SpringReader {
 public:
  SpringReader(const Settings& scenario, const std::string& physics, World& world, const ReadNumber& number)
      : root_(scenario), physics_(physics), world_(world), number_(number), mass_(world.moving_mass()) {}

  void run() {
    const auto contact = root_.find("contact"), uncertain = root_.find("uncertain");
    if (contact) read_contact(*contact);
    if (const auto environment = root_.find("environment")) {
      std::size_t i = 0;
      for (const auto& [name, settings] : environment->entries()) {
        read(settings, "environment." + name, world_.contact.spring, world_.objects[i++].spring);
      }
    }
    if (uncertain && uncertain->is_map()) {
      for (const auto& [pattern, value] : uncertain->entries()) {
        if (is_spring(pattern)) note(value);
      }
    }
    const bool drawn = (uncertain && uncertain->is_map() && uncertain->has("contact.model")) ||
                       (contact && contact->has("model") && contact->at("model").is_map());
    if (!drawn && world_.contact.model != kCompliant) doubt();
  }

 private:
  static bool is_spring(const std::string& path) {
    return (path.starts_with("contact.") || path.starts_with("environment.")) &&
           (path.ends_with(".stiffness") || path.ends_with(".damping"));
  }

  void read_contact(const Settings& contact) {
    read(contact, "contact", {}, world_.contact.spring);
    const auto pairs = contact.find("pairs");
    if (!pairs) return;
    std::size_t i = 0;
    for (const Settings& pair : pairs->items()) read_pair(pair, world_.contact.pairs[i++].spring);
  }

  static Parameter parameter(const std::string& path, Quantity quantity, double lower, double upper) {
    Parameter out;
    out.path = path;
    out.quantity = quantity;
    out.lower = lower;
    out.upper = upper;
    return out;
  }

  /// Of `map`, whose parameters' paths begin with `path`. `above`: the spring that counts where this one lacks
  /// something.
  void read(const Settings& map, const std::string& path, const Spring& above, Spring& out) {
    if (map.has("stiffness")) {
      out.stiffness = default_spring(mass_, above).stiffness;
      number_(map, "stiffness", parameter(path + ".stiffness", Quantity::stiffness, kMinStiffness, kMaxStiffness),
              out.stiffness);
      note(map.at("stiffness"));
    }
    if (map.has("damping")) {
      out.damping = default_spring(mass_, out.or_else(above)).damping;
      number_(map, "damping", parameter(path + ".damping", Quantity::damping, 0, kMaxDamping), out.damping);
      note(map.at("damping"));
    }
  }

  void read_pair(const Settings& pair, Spring& out) {
    if (const auto stiffness = pair.find("stiffness")) {
      out.stiffness = stiffness->within(kMinStiffness, kMaxStiffness, Quantity::stiffness);
      note(*stiffness);
    }
    if (const auto damping = pair.find("damping")) {
      out.damping = damping->within(0, kMaxDamping, Quantity::damping);
      note(*damping);
    }
  }

  /// Refuses what the back end does not have, and keeps where it is written.
  void note(const Settings& written) {
    if (!world_.has_springs()) {
      written.fail_key(
          fmt::format("a spring goes with contact.model: {}, which physics: {} does not have; take it out, "
                      "or did you mean physics: lanes?",
                      kCompliant, physics_));
    }
    written_.push_back(written);
  }

  void doubt() const {
    for (const Settings& one : written_) {
      warn(one, fmt::format("does nothing under contact.model: {}, which is rigid; did you mean contact.model: {}?",
                            world_.contact.model, kCompliant));
    }
  }

  const Settings& root_;
  const std::string& physics_;
  World& world_;
  const ReadNumber& number_;
  double mass_;                    // kg, of all that moves, nominally
  std::vector<Settings> written_;  // where a stiffness or a damping stands
};

}  // namespace

void read_springs(const Settings& scenario, const std::string& physics, World& world, const ReadNumber& number) {
  SpringReader(scenario, physics, world, number).run();
}

}  // namespace graze
