#include "scenarios/keys.h"

#include <fmt/format.h>

#include <cassert>

#include "engine/physics.h"
#include "sampling/design_name.h"
#include "scenarios/distributions.h"
#include "scenarios/hull_reader.h"
#include "scenarios/shapes.h"
#include "scenarios/witnesses.h"

namespace graze {

std::vector<std::string> shape_names() { return names_of(shape_forms()); }

std::vector<std::string> distribution_names() { return names_of(distribution_kinds()); }

namespace {

/// A key that is a component's name. What stands behind it: a map, if it has keys or nothing else may stand there, or
/// the rest.
Key component_key(const char* kind, const std::string& name, const Description& text) {
  std::vector<Form> forms = text.instead;
  if (!text.keys.empty() || forms.empty()) forms.push_back(Form::section(std::string(kind) + "." + name));
  return {name, forms, {}, text.help};
}

Description scenario() {
  return {
      "a campaign: one robot, its world, what is uncertain about them, policies and a task",
      {{"graze", {Form::whole(Bound::positive)}, Default::required(), "version of the format, 1"},
       {"name", {Form::text("TEXT")}, {}, "one line for tables"},
       {"description", {Form::text("TEXT")}, {}, "what the scenario is for"},
       {"robot", {Form::section("robot")}, Default::required(), "the robot, and how it begins"},
       {"environment", {Form::section("environment")}, {}, "objects by name"},
       {"gravity",
        {Form::number(Quantity::acceleration, Bound::not_negative), Form::numbers(3, Quantity::acceleration)},
        Default::value("9.81 m/s^2"),
        "downward, or a vector `[x, y, z]`"},
       {"contact", {Form::section("contact")}, {}, "how parts meet"},
       {"disturbances", {Form::section("disturbances")}, {}, "pushes and payloads by name"},
       {"physics", {Form::word(physics_names())}, Default::value("lanes"), "back end (docs/physics.md)"},
       {"time", {Form::section("time")}, {}, "steps and end of a trace"},
       {"actuators", {Form::section("actuators")}, {}, "what the motors can do"},
       {"control", {Form::section("control")}, {}, "between policy and tracker"},
       {"uncertain", {Form::section("uncertain")}, {}, "distributions by glob of parameter paths; later entries win"},
       {"sampling", {Form::section("sampling")}, {}, "how particles are drawn"},
       {"policies", {Form::section("policies")}, Default::required(), "policies by name"},
       {"task", {Form::section("task")}, {}, "what a trace is judged by"},
       {"record", {Form::section("record")}, {}, "what is kept of a trace"},
       {"design", {Form::section("design")}, {}, "what `graze improve` may change (docs/improve.md)"}}};
}

Description design() {
  return {
      "what `graze improve` may change so that limits hold",
      {{"variables", {Form::section("design_variables")}, Default::required(), "numbers of the design by name"},
       {"fixed",
        {Form::sections(-1, "design_total", "[{sum: [GLOB, …]}, …]")},
        {},
        "sums of variables, by their names, that no step changes: the length of a leg, the robot's mass"},
       {"limits",
        {Form::texts(-1, "GLOB"), Form::text("GLOB")},
        Default::words("all requirements, and `objective`"),
        "the requirements and measures that must hold; `objective` is one, too"},
       {"task", {Form::section("design_task")}, {}, "how the task becomes harder"},
       {"window",
        {Form::number(Quantity::time, Bound::positive)},
        Default::words("the whole trace"),
        "from the first violation on: what is improved at a time"},
       {"begin",
        {Form::word({"start", "recorded"})},
        Default::value("start"),
        "where traces of differences begin: at the `start`, or with the window, in the state that was `recorded` "
        "there"},
       {"quantile", {Form::fraction()}, Default::value("10 %"), "of the margins of particles, with `--particles`"}}};
}

Description design_variable() {
  return {"a number of the design, or several that move together",
          {{"of",
            {Form::text("GLOB"), Form::texts(-1, "GLOB")},
            Default::required(),
            "parameters of links and joints, or settings of policies; equal ones stay equal, others keep their ratio"},
           {"within", {Form::drawn_list(2)}, {}, "its bounds; of several, of the first"},
           {"factor", {Form::numbers(2)}, {}, "instead of `within`: bounds as multiples of its value"},
           {"choose",
            {Form::text_rows(-1, "VALUE")},
            {},
            "instead of `within`: a list of choices, such as motors; of each, a value for each GLOB of `of`"},
           {"step", {Form::drawn()}, Default::words("a thousandth from bound to bound"), "of differences"}},
          {{"within", "factor", "choose"}}};
}

Description design_total() {
  return {
      "a sum of design variables that stays",
      {{"sum",
        {Form::texts(-1, "GLOB"), Form::text("GLOB")},
        Default::required(),
        "names of variables: of all the numbers that they stand for the sum stays what it is; a variable belongs to "
        "one sum at most"}}};
}

Description design_task() {
  return {"how the task becomes harder",
          {{"path", {Form::text("PATH")}, Default::required(), "of a setting of the scenario, as for `--set`"},
           {"values", {Form::labels(), Form::rows(-1)}, Default::required(), "its values, the easiest first"}}};
}

Description robot() {
  return {"the robot",
          {{"urdf", {Form::text("FILE")}, Default::required(), "relative to the file in which the key stands"},
           {"base",
            {Form::word({"floating", "fixed"})},
            Default::words("as the URDF says"),
            "fixed, to a root link `world`, or free"},
           {"density",
            {Form::number(Quantity::density, Bound::positive)},
            Default::value("1000 kg/m^3"),
            "of links with geometry but no `<inertial>`"},
           {"package_path",
            {Form::texts(-1, "FOLDER"), Form::text("FOLDER")},
            {},
            "folders in which `package://NAME/` is looked up"},
           {"ignore_initial_overlaps",
            {Form::flag()},
            Default::value("false"),
            "links that are in each other in the nominal initial state never touch"},
           {"mesh",
            {Form::section("hull"), Form::word({"hulls"})},
            {},
            "how its collision meshes may be simplified; `hulls`: concave ones are several hulls"},
           {"repair",
            {Form::flag()},
            Default::value("false"),
            "mends what can be mended in the URDF, and tells it (docs/robots.md)"},
           {"srdf", {Form::text("FILE")}, {}, "its `disable_collisions` are pairs of links that never touch"},
           {"initial", {Form::section("initial")}, {}, "how it begins"}}};
}

Description initial() {
  const Default zero = Default::value("[0, 0, 0]");
  return {"how the robot begins",
          {{"position", {Form::numbers(3, Quantity::length)}, zero, "`[x, y, z]` of the base"},
           {"rpy", {Form::numbers(3, Quantity::angle)}, zero, "`[roll, pitch, yaw]`: Rz(yaw) Ry(pitch) Rx(roll)"},
           {"orientation", {Form::numbers(4)}, {}, "instead of `rpy`: quaternion `[w, x, y, z]`"},
           {"height",
            {Form::number(Quantity::length), Form::word({"on_ground"})},
            {},
            "z of the base, or `on_ground`: the lowest point touches z = 0, or a heightfield below it"},
           {"clearance", {Form::number(Quantity::length)}, Default::value("0 m"), "below the lowest point", "height"},
           {"velocity", {Form::numbers(3, Quantity::velocity)}, zero, "of the base, world axes"},
           {"angular_velocity", {Form::numbers(3, Quantity::angular_velocity)}, zero, "of the base, world axes"},
           {"joints",
            {Form::named_numbers("JOINT")},
            Default::words("0, or the limit nearest to 0"),
            "positions by glob; later entries win"},
           {"joint_velocities", {Form::named_numbers("JOINT")}, Default::words("0"), "velocities by glob"}}};
}

Key number_or_spread(const char* name, Quantity quantity, Bound bound, const Default& otherwise, const char* help) {
  return {name, {Form::number(quantity, bound), Form::spread()}, otherwise, help};
}

Description object() {
  Description out("an object of the environment: one shape, and where and what it is");
  for (const ShapeForm& shape : shape_forms()) out.keys.push_back(component_key("shape", shape.name, shape.text));
  const Default zero = Default::value("[0, 0, 0]"), contact = Default::words("as `contact` says");
  const std::vector<Key> rest = {
      {"position", {Form::numbers(3, Quantity::length)}, zero, "of its origin, `[x, y, z]`"},
      {"rpy", {Form::numbers(3, Quantity::angle)}, zero, "`[roll, pitch, yaw]`"},
      {"movable", {Form::flag()}, Default::value("false"), "it moves freely"},
      number_or_spread("density", Quantity::density, Bound::positive, {}, "of a movable object, or its mass"),
      number_or_spread("mass", Quantity::mass, Bound::positive, {}, "of a movable object, or its density"),
      number_or_spread("friction", Quantity::dimensionless, Bound::not_negative, contact, "Coulomb coefficient"),
      number_or_spread("restitution", Quantity::dimensionless, Bound::fraction, contact, "Newton's"),
      number_or_spread("stiffness", Quantity::stiffness, Bound::positive, contact,
                       "of each point of a `compliant` contact"),
      number_or_spread("damping", Quantity::damping, Bound::not_negative, contact,
                       "of each point of a `compliant` contact"),
  };
  out.keys.insert(out.keys.end(), rest.begin(), rest.end());
  out.one_of = {shape_names()};
  return out;
}

Description disturbance() {
  const Default none = Default::value("0 rad");
  return {"what is done to the robot during a trace: a push, or a payload that is put on it",
          {{"push", {Form::text("LINK")}, {}, "a link, or a movable object, is pushed"},
           {"payload", {Form::text("LINK")}, {}, "a point mass becomes part of it, and stays"},
           number_or_spread("at", Quantity::time, Bound::not_negative, Default::required(), "when it begins"),
           number_or_spread("impulse", Quantity::impulse, Bound::none, {}, "of a push, all of it; or its force"),
           number_or_spread("force", Quantity::force, Bound::none, {}, "of a push, even over its duration"),
           number_or_spread("duration", Quantity::time, Bound::not_negative, Default::value("0 s"),
                            "of a push; 0: within one step (an impulse alone)"),
           number_or_spread("azimuth", Quantity::angle, Bound::none, none,
                            "of a push: where it goes, about z from x, world axes"),
           number_or_spread("elevation", Quantity::angle, Bound::none, none, "of a push: how far it points upward"),
           number_or_spread("mass", Quantity::mass, Bound::not_negative, {}, "of a payload"),
           {"point",
            {Form::numbers(3, Quantity::length)},
            Default::value("[0, 0, 0]"),
            "where, `[x, y, z]` in the link's frame"}},
          {{"push", "payload"}}};
}

Description pair() {
  const auto positive = Form::number(Quantity::stiffness, Bound::positive);
  const auto not_negative = Form::number(Quantity::damping, Bound::not_negative);
  return {"what two parts have of their own when they meet",
          {{"between", {Form::texts(2, "PART")}, Default::required(), "globs of parts"},
           {"friction", {Form::number(Quantity::dimensionless, Bound::not_negative)}, {}, "Coulomb coefficient"},
           {"restitution", {Form::fraction()}, {}, "Newton's"},
           {"stiffness", {positive}, {}, "of each point of a `compliant` contact"},
           {"damping", {not_negative}, {}, "of each point of a `compliant` contact"}}};
}

Description contact() {
  return {
      "how parts meet",
      {number_or_spread("friction", Quantity::dimensionless, Bound::not_negative, Default::value("1"),
                        "Coulomb coefficient of objects that give none"),
       number_or_spread("restitution", Quantity::dimensionless, Bound::fraction, Default::value("0"),
                        "Newton's, of objects that give none"),
       number_or_spread("stiffness", Quantity::stiffness, Bound::positive,
                        Default::words("what moves, on one point, sinks in by 0.5 mm"),
                        "of each point of a `compliant` contact with objects that give none"),
       number_or_spread("damping", Quantity::damping, Bound::not_negative,
                        Default::words("critical for the mass of what moves"),
                        "of each point of a `compliant` contact with objects that give none"),
       {"model", {Form::text("NAME"), Form::spread()}, Default::words("the back end's first"), "one of the back end's"},
       {"solver",
        {Form::word({"auto", "sweeps", "newton"})},
        Default::value("auto"),
        "of `lanes`: sweeps and, where they do not converge, Newton's method; or one of them"},
       {"pairs", {Form::maps(pair())}, {}, "what some pairs of parts have of their own"},
       {"ignore", {Form::text_rows(2, "PART")}, {}, "pairs of globs of parts that never touch"},
       {"self_collision",
        {Form::flag()},
        Default::value("true"),
        "links of the robot that are not neighbours may touch"},
       {"unconverged",
        {Form::fraction()},
        Default::value(fmt::format("{:g} %", 100 * kUnconvergedShare)),
        "share of a trace's steps whose contacts may not have converged; a trace with more is flagged "
        "(docs/physics.md)"}},
      {},
      {},
      "A part is a collision shape: its link's name, with `.1`, `.2` … behind it for further shapes of a link, or an "
      "object's name."};
}

Description spread() {
  Description out("one distribution (else the nominal value), and jitter");
  for (const DistributionKind& kind : distribution_kinds()) {
    out.keys.push_back(component_key("distribution", kind.name, kind.text));
  }
  out.keys.push_back({"jitter", {Form::section("jitter", "distribution")}, {}, "added afresh at every control step"});
  return out;
}

Description jitter() {
  Description out("a distribution that is drawn at every control step; its middle is 0 unless it is given");
  for (const DistributionKind& kind : distribution_kinds()) {
    if (!kind.of_words) out.keys.push_back(component_key("distribution", kind.name, kind.text));
  }
  out.keys.push_back(component_key("distribution", "noise", noise_description()));
  return out;
}

Description axis() {
  return {"the error of a joint's axis",
          {{"cone", {Form::map(cone_description())}, Default::required(), cone_description().help}}};
}

Description correlated() {
  return {"parameters that vary together, by a Gaussian copula",
          {{"parameters", {Form::texts(-1, "GLOB")}, Default::required(), "which of those that are uncertain"},
           {"correlation",
            {Form::number(Quantity::dimensionless, Bound::correlation), Form::rows(-1)},
            Default::required(),
            "one coefficient for all pairs, or the matrix"}}};
}

Description sampling() {
  std::vector<std::string> designs;
  for (const Design design : kDesigns) {
    designs.emplace_back(design_name(design));
  }
  return {"how particles are drawn",
          {{"design", {Form::word(designs)}, Default::value(designs.front()), "docs/sampling.md"},
           {"seed", {Form::whole(Bound::not_negative)}, Default::value("1"), "of --seed"},
           {"particles", {Form::whole(Bound::positive)}, Default::value("100"), "of -n"}}};
}

Description timing() {
  const Form time = Form::number(Quantity::time, Bound::positive);
  return {"steps and end of a trace",
          {{"end", {time}, Default::value("1 s"), "of a trace, a whole multiple of step"},
           {"step", {time}, Default::value("1 ms"), "of the physics"},
           {"control", {time}, Default::words("step"), "of the policies, a whole multiple of step"}}};
}

Description record() {
  return {"what is kept of a trace",
          {{"telemetry",
            {Form::word({"none", "failures", "last", "all"})},
            Default::value("none"),
            "which traces keep frames of state and torques; `last`: of failures the last seconds before it"},
           {"every", {Form::whole(Bound::positive)}, Default::value("10"), "physics steps from frame to frame"},
           {"last",
            {Form::number(Quantity::time, Bound::positive)},
            Default::value("0.5 s"),
            "with `telemetry: last`: how long before the first violation, or the trace's end"},
           {"phases",
            {Form::flag(), Form::section("phases")},
            Default::value("true"),
            "contact phases: which parts touch from when to when, how hard, sticking, slipping or rolling"},
           {"events",
            {Form::flag()},
            Default::value("false"),
            "every touch, lift-off, change between stick, slip and roll, and joint limit"}}};
}

Description phases() {
  return {"what makes a contact phase of the touches of two parts",
          {{"gap",
            {Form::number(Quantity::time, Bound::not_negative)},
            Default::value("20 ms"),
            "a touch within this time after the last continues its phase"},
           {"dwell",
            {Form::number(Quantity::time, Bound::not_negative)},
            Default::value("2 ms"),
            "a phase that is shorter, and carries less than `impulse`, is none"},
           {"impulse",
            {Form::number(Quantity::impulse, Bound::not_negative)},
            Default::words(fmt::format("what the robot's weight makes in {:g} ms", 1e3 * kPhaseWeightTime)),
            "see `dwell`"}}};
}

Description task() {
  return {"what a trace is judged by",
          {{"requirements",
            {Form::section("requirements")},
            {},
            "witnesses by name that stay >= 0, or the trace is a known failure"},
           {"measures", {Form::section("measures")}, {}, "witnesses by name that are watched alike and decide nothing"},
           {"objective",
            {Form::section("objective", "predicate")},
            Default::words("reach the end"),
            "a predicate, with a name or without; unmet, the trace is an unknown failure"},
           {"stop_at_violation", {Form::flag()}, Default::value("true"), "the first violation ends the trace"}}};
}

}  // namespace

const std::map<std::string, Description>& scenario_sections() {
  static const std::map<std::string, Description> all = {
      {"scenario", scenario()},
      {"robot", robot()},
      {"hull", {"how far collision meshes may be simplified", robot_hull_keys()}},
      {"initial", initial()},
      {"object", object()},
      {"contact", contact()},
      {"disturbance", disturbance()},
      {"pair", pair()},
      {"spread", spread()},
      {"jitter", jitter()},
      {"axis", axis()},
      {"correlated", correlated()},
      {"sampling", sampling()},
      {"time", timing()},
      {"actuators",
       {"what the motors can do",
        {{"torque_speed",
          {Form::flag()},
          Default::value("false"),
          "the torque falls linearly to 0 at a joint's velocity limit"},
         {"gear",
          {Form::joint_numbers(Quantity::dimensionless, Bound::positive)},
          Default::value("1"),
          "turns of the rotor per turn of the joint; of a prismatic joint rad/m"},
         {"rotor_inertia",
          {Form::joint_numbers(Quantity::inertia, Bound::not_negative)},
          Default::value("0 kg m^2"),
          "of each drive's rotor about its axis; gear² times it adds to the joint's inertia (`lanes` alone)"}}}},
      {"control",
       {"between policy and tracker",
        {number_or_spread("lag", Quantity::time, Bound::not_negative, Default::value("0 s"),
                          "from the policy's command to the tracker")}}},
      {"record", record()},
      {"phases", phases()},
      {"task", task()},
      {"design", design()},
      {"design_variable", design_variable()},
      {"design_total", design_total()},
      {"design_task", design_task()},
      {"requirement", requirement_description()},
      {"predicate", predicate_description()},
  };
  return all;
}

const Description& section_of(const std::string& name) {
  const auto found = scenario_sections().find(name);
  assert(found != scenario_sections().end());
  return found->second;
}

std::vector<std::string> keys_of(const std::string& section) { return section_of(section).names(); }

}  // namespace graze
