// graze drive: a robot that is driven by keys while it is simulated.
#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <chrono>
#include <iostream>
#include <iterator>
#include <memory>
#include <optional>
#include <span>
#include <sstream>

#include "analysis/number_words.h"
#include "archive/files/files.h"
#include "archive/files/parent_folders.h"
#include "archive/files/shell_word.h"
#include "archive/files/utf8.h"
#include "engine/settings/inputs.h"
#include "jobs/campaign/drive_session.h"
#include "jobs/campaign/nominal_estimate.h"
#include "jobs/cli/commands.h"
#include "jobs/cli/drive_keys.h"
#include "jobs/cli/drive_page.h"
#include "jobs/cli/drive_screen.h"
#include "jobs/cli/live_page.h"
#include "jobs/cli/option_values.h"
#include "jobs/cli/raw_terminal.h"

namespace graze {
namespace {

constexpr double kBetweenPictures = 0.05;  // s between two pictures
constexpr double kMostBehind = 0.25;       // s: what the machine cannot catch up is not caught up
constexpr double kZoomStep = 1.25;
constexpr const char* kLongDrive = "600 s";  // a person's, unless the scenario's end is set

struct DriveArguments {
  ScenarioArguments scenario;
  std::optional<std::uint64_t> particle;
  std::optional<std::uint64_t> seed;
  std::string keys, replay, record;
  GaitTrial trial;
  std::optional<std::uint64_t> page;  // port
  bool force = false;
};

std::string verdict_text(const GaitVerdict& told) {
  if (told.particles == 0) return fmt::format("{} refused: no particle of it is valid", told.to);
  std::string out = fmt::format("{} {}: {:.0f} % of {} particles keep all requirements for {:g} s ({:.0f} % under {})",
                                told.to, told.accepted ? "accepted" : "refused", 100 * told.kept, told.particles,
                                told.horizon, 100 * told.kept_by_stay, told.from);
  return told.first_violated.empty() ? out : out + fmt::format("; most of the others violate {}", told.first_violated);
}

/// Keys on their way to the robot.
class Driver {
 public:
  Driver(DriveSession& session, const Scenario& scenario) : session_(session), screen_(scenario) {}

  /// False: the drive is to end.
  bool press(const std::string& key) {
    if (key == "q") return false;
    if (steer(key)) return true;
    if (key == "+" || key == "-") screen_.zoom(key == "+" ? kZoomStep : 1 / kZoomStep);
    if (const auto policy = chosen_by(key)) choose(*policy);
    if (wheel_.press(key)) session_.command(wheel_.forward(), wheel_.strafe(), wheel_.turn());
    return true;
  }

  void advance(bool tell) {
    const auto verdict = session_.advance();
    if (!verdict) return;
    message_ = verdict_text(*verdict);
    if (tell) std::cout << fmt::format("{:.3f} s: {}\n", session_.sight().time, message_);
  }

  void draw(RawTerminal& terminal, double pace) {
    const RawTerminal::Size size = terminal.size();
    terminal.draw(
        screen_.lines(session_, size.columns, size.rows, pace, wheel_.is_car(), message_.empty() ? note_ : message_));
  }
  std::string frame(double pace) { return drive_page_frame(session_, {pace, wheel_.is_car(), false, message_}); }
  std::string last_frame(const std::string& message) {
    return drive_page_frame(session_, {1, wheel_.is_car(), true, message});
  }
  /// What the terminal shows as long as there is nothing to tell.
  void note(std::string text) { note_ = std::move(text); }

 private:
  /// "stick F S T", from a gamepad.
  bool steer(const std::string& word) {
    std::istringstream words(word);
    std::string what;
    double forward = 0, strafe = 0, turn = 0;
    if (!(words >> what >> forward >> strafe >> turn) || what != "stick") return false;
    wheel_.steer(forward, strafe, turn);
    session_.command(wheel_.forward(), wheel_.strafe(), wheel_.turn());
    return true;
  }

  void choose(std::size_t policy) {
    if (policy >= session_.policies().size()) {
      message_ = fmt::format("there are {} policies to drive under", session_.policies().size());
      return;
    }
    session_.choose(policy);
    if (session_.tried()) message_ = fmt::format("{} is being tried", session_.policies()[*session_.tried()]);
  }

  DriveSession& session_;
  DriveScreen screen_;
  DriveWheel wheel_;
  std::string message_, note_;
};

double now() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

/// Where a drive that goes by the clock is seen and steered from.
struct Cockpit {
  bool terminal = false;
  LivePage* page = nullptr;           // null: none
  std::vector<TimedKey> script = {};  // keys that are pressed by themselves
};

/// What has been pressed: by the script until now, in the terminal within `seconds`, on the page. False: no more is to
/// come from the terminal.
bool collect_keys(Cockpit& cockpit, RawTerminal& terminal, std::string& bytes, double time, double seconds,
                  std::vector<std::string>& keys) {
  std::string more;
  const bool goes_on = terminal.read(seconds, more);
  bytes += more;
  keys = decode_keys(bytes);
  auto next = cockpit.script.begin();
  for (; next != cockpit.script.end() && next->time <= time + kCommandSlack; ++next) keys.push_back(next->key);
  cockpit.script.erase(cockpit.script.begin(), next);
  if (!cockpit.page) return goes_on;
  for (std::string& one : cockpit.page->pressed()) keys.push_back(std::move(one));
  return goes_on;
}

/// As fast as the clock, or as the machine can. Returns the signal that has ended it, or 0.
int drive_live(DriveSession& session, Driver& driver, Cockpit cockpit) {
  RawTerminal terminal(cockpit.terminal);
  double start = now(), pace = 1;  // `start`: the clock when the robot's was 0
  std::string bytes;
  std::vector<std::string> keys;
  bool goes_on = true;
  while (goes_on && !session.ended() && terminal.asked_to_end() == 0) {
    const double frame_end = now() + kBetweenPictures;
    while (!session.ended() && session.sight().time < now() - start && now() < frame_end) driver.advance(false);
    const double behind = now() - start - session.sight().time;
    pace += 0.1 * ((behind > kBetweenPictures ? kBetweenPictures / (kBetweenPictures + behind) : 1) - pace);
    if (behind > kMostBehind) start += behind;
    driver.draw(terminal, pace);
    if (cockpit.page) cockpit.page->show(driver.frame(pace));
    goes_on = collect_keys(cockpit, terminal, bytes, session.sight().time, std::max(0.0, frame_end - now()), keys);
    for (const std::string& key : keys) goes_on = goes_on && driver.press(key);
    if (terminal.stopped_and_went_on()) start = now() - session.sight().time;
  }
  return terminal.asked_to_end();
}

/// Throws InputError where a script chooses a policy that there is not.
void check_choices(const std::vector<TimedKey>& keys, const std::vector<std::string>& policies) {
  for (const TimedKey& one : keys) {
    const std::optional<std::size_t> policy = chosen_by(one.key);
    if (!policy || *policy < policies.size()) continue;
    throw InputError(fmt::format("{}: '{}' chooses policy {} of {}; nearest right answer: {}, which is {}", one.where,
                                 one.key, *policy + 1, policies.size(), policies.size(), policies.back()));
  }
}

/// Tells of what a file asks for after the end of the drive. where: of the first, which is at `time`; more: behind it.
void tell_of_rest(const DriveSession& session, const std::string& where, double time, std::size_t more) {
  const Outcome outcome = session.record().outcome;
  const bool in_full = outcome == Outcome::success || outcome == Outcome::unknown_failure;
  spdlog::warn("{}: is at {:g} s, and the drive ended at {:g} s{}{}", where, time, session.sight().time,
               more > 0 ? fmt::format(", with {} more behind it", more) : "",
               in_full ? "; --set time.end=… drives longer" : "");
}

void drive_by_script(DriveSession& session, Driver& driver, const std::vector<TimedKey>& keys) {
  auto next = keys.begin();
  while (!session.ended()) {
    for (; next != keys.end() && next->time <= session.sight().time + kCommandSlack; ++next) {
      if (!driver.press(next->key)) return;
    }
    driver.advance(true);
  }
  if (next == keys.end()) return;
  tell_of_rest(session, next->where, next->time, static_cast<std::size_t>(keys.end() - next) - 1);
}

void drive_by_commands(DriveSession& session, const std::vector<CommandRow>& rows, const std::string& name) {
  std::vector<std::size_t> policies;
  for (const CommandRow& row : rows) {
    const auto& names = session.policies();
    const auto found = row.policy.empty() ? names.begin() : std::find(names.begin(), names.end(), row.policy);
    if (found == names.end()) {
      throw InputError(fmt::format("{}:{}:{}: '{}' is no policy that can be driven; {}", name, row.line,
                                   row.policy_column, row.policy, nearest_or_all(row.policy, names)));
    }
    policies.push_back(static_cast<std::size_t>(found - names.begin()));
  }
  std::size_t next = 0;
  while (!session.ended()) {
    for (; next < rows.size() && rows[next].time <= session.sight().time + kCommandSlack; ++next) {
      session.go_on_under(policies[next], rows[next]);
    }
    session.advance();
  }
  if (next == rows.size()) return;
  tell_of_rest(session, fmt::format("{}:{}", name, rows[next].line), rows[next].time, rows.size() - next - 1);
}

bool is_one_policy(const std::vector<CommandRow>& rows) {
  return std::all_of(rows.begin(), rows.end(), [&](const CommandRow& row) { return row.policy == rows[0].policy; });
}

/// Commands that do the same again.
std::string again_text(const DriveArguments& arguments, const DriveSession& session, const Scenario& scenario) {
  const ScenarioArguments& chosen = arguments.scenario;
  const std::string file = shell_word(arguments.record), scene = shell_word(chosen.file);
  const std::string from = chosen.file == kStandardInput ? " <SCENARIO.yaml" : "";
  std::string options = chosen.options_without("time.end");
  options += fmt::format(" --set time.end={}", session.record().end_time);
  if (arguments.seed) options += fmt::format(" --seed {}", *arguments.seed);
  const std::string particle = arguments.particle ? fmt::format(" --particle {}", *arguments.particle) : "";
  std::string out = fmt::format("Again: graze drive {} --replay {}{}{}{}\n", scene, file, options, particle, from);
  const std::string& policy = session.rows().front().policy;
  if (!is_one_policy(session.rows()) || policy.find('/') != std::string::npos) return out;
  const auto spec = std::find_if(scenario.policies.begin(), scenario.policies.end(),
                                 [&](const PolicySpec& one) { return one.name == policy; });
  const char* const part = spec->settings.has("gait") ? "gait" : "network";
  std::string away;
  for (const char* key : {"velocity", "waypoints"}) {
    if (spec->settings.at(part).has(key)) away = fmt::format(" --set 'policies.{}.{}.{}=~'", policy, part, key);
  }
  const std::string alone = scenario.policies.size() > 1 ? " --policy " + shell_word(policy) : "";
  return out + fmt::format(
                   "All robots by these commands: graze run {}{}{} --set policies.{}.{}.commands={}{}{}; then "
                   "graze view shows one in three dimensions\n",
                   scene, options, away, policy, part, file, alone, from);
}

/// Into the file that was made before the drive. What cannot be written there is printed: nobody drives twice alike.
void write_record(NewFile& file, const std::string& path, const std::string& text) {
  try {
    const int error = write_all(file.descriptor(), std::as_bytes(std::span(text)));
    if (error != 0) fail_writing(path, error);
    file.publish();
  } catch (const std::exception&) {
    std::cerr << "the commands of the drive, which could not be written:\n" << text;
    throw;
  }
}

void check(const DriveArguments& arguments) {
  if (!arguments.keys.empty() && !arguments.replay.empty()) {
    throw InputError("--replay: stands beside --keys; one of them must go");
  }
  if (!arguments.replay.empty() && arguments.page) {
    throw InputError("--page: a drive that is replayed is over at once; graze view shows its trace (docs/drive.md)");
  }
}

/// Whether --record may write where it is told to.
void check_record(const DriveArguments& arguments, const Scenario& scenario) {
  std::vector<std::filesystem::path> made_of = files_of(scenario);
  for (const std::string& file : {arguments.keys, arguments.replay}) {
    if (!file.empty()) made_of.emplace_back(file);
  }
  check_new_file(arguments.record, arguments.force, made_of, NamedBy::word);
}

/// Keys from --keys, or from standard input that is no terminal; none: a person presses them.
std::optional<std::vector<TimedKey>> scripted_keys(const DriveArguments& arguments) {
  if (!arguments.keys.empty()) return parse_key_script(read_input(input_path(arguments.keys)), arguments.keys);
  if (arguments.page) return std::vector<TimedKey>();  // it has keys of its own
  if (isatty(STDIN_FILENO) == 0) {
    if (arguments.scenario.file == kStandardInput) {
      throw InputError("drive -: the scenario comes from standard input, and so would the keys; give --keys FILE");
    }
    return parse_key_script(read_standard_input(), "standard input");
  }
  if (isatty(STDOUT_FILENO) != 0) return std::nullopt;
  throw InputError(
      "drive: standard output is no terminal, which the view needs; --keys FILE drives without one, --page in a "
      "browser");
}

Scenario load(const DriveArguments& arguments, bool live) {
  ScenarioArguments chosen = arguments.scenario;
  const auto is_end = [](const std::string& one) { return one.starts_with("time.end=") || one.starts_with("time="); };
  if (live && std::none_of(chosen.set.begin(), chosen.set.end(), is_end)) {
    chosen.set.push_back(std::string("time.end=") + kLongDrive);
  }
  return chosen.load();
}

int drive(const DriveArguments& arguments) {
  check(arguments);
  const bool terminal = isatty(STDIN_FILENO) != 0 && isatty(STDOUT_FILENO) != 0 && arguments.keys.empty();
  std::optional<std::vector<TimedKey>> keys;
  if (arguments.replay.empty() && !(arguments.page && terminal)) keys = scripted_keys(arguments);
  Scenario scenario = load(arguments, arguments.replay.empty() && (!keys || arguments.page));
  if (!arguments.record.empty()) check_record(arguments, scenario);
  if (arguments.seed) scenario.seed = *arguments.seed;
  const Simulation simulation(std::move(scenario));
  std::optional<ParentFolders> folders;
  std::optional<NewFile> recorded;  // made first: a place that cannot be written is refused before the drive
  if (!arguments.record.empty()) {
    folders.emplace(arguments.record);
    recorded.emplace(arguments.record, arguments.force);
  }
  DriveSession session(simulation, arguments.particle, arguments.trial, arguments.page.has_value());
  if (keys) check_choices(*keys, session.policies());
  Driver driver(session, simulation.scenario());
  std::unique_ptr<LivePage> page;
  if (arguments.page) {
    page = std::make_unique<LivePage>(drive_page_data(session, simulation.scenario()),
                                      static_cast<std::uint16_t>(*arguments.page));
    std::cerr << "graze: the drive can be seen, and steered, at " << page->address() << "\n" << std::flush;
    driver.note("see " + page->address());
  }
  int signal = 0;
  if (!arguments.replay.empty()) {
    drive_by_commands(session, parse_commands(read_input(input_path(arguments.replay)), arguments.replay),
                      arguments.replay);
  } else if (keys && !page) {
    drive_by_script(session, driver, *keys);
  } else {
    signal = drive_live(session, driver, {terminal, page.get(), keys.value_or(std::vector<TimedKey>())});
  }
  session.stop();
  const TraceRecord& record = session.record();
  if (page) {
    page->show(driver.last_frame(fmt::format("the drive has ended: {}", how_it_ends(simulation.scenario(), record))));
    page.reset();
  }
  std::string under;
  for (const CommandRow& row : session.rows()) {
    if (under.empty() || !under.ends_with(row.policy)) under += (under.empty() ? "" : ", ") + row.policy;
  }
  const Vec3& at = session.sight().position;
  std::cout << fmt::format("{:g} s under {}: {}; at x {:.3f} m, y {:.3f} m; digest {:016x}\n", record.end_time, under,
                           how_it_ends(simulation.scenario(), record), at.x(), at.y(), record.digest);
  if (!arguments.record.empty()) {
    write_record(*recorded, arguments.record, commands_text(session.rows()));
    std::cout << fmt::format("{}: {}\n", arguments.record, counted(session.rows().size(), "command", "commands"))
              << again_text(arguments, session, simulation.scenario());
  }
  if (signal != 0) throw MachineError(fmt::format("drive: ended by signal {}", signal));
  return kDone;
}

double read_share(const std::string& text, const std::string& option) {
  const Settings value = Settings::parse("share: " + text, option).at("share");
  return value.within(0, 1);
}

void add_options(CLI::App& verb, DriveArguments& arguments) {
  arguments.scenario.add_to(verb);
  add_whole(verb, "--particle", arguments.particle, 0, kParticleLimit - 1,
            "Which robot, as graze run has it (default: the nominal one)");
  add_whole(verb, "--seed", arguments.seed, 0, std::numeric_limits<std::uint64_t>::max(),
            "Root seed (default: the scenario's)");
  verb.add_option("--keys", arguments.keys, "Press these keys, lines TIME KEY, instead of waiting for some")
      ->type_name("FILE");
  verb.add_option("--replay", arguments.replay, "Do what a recorded command file says")->type_name("FILE.csv");
  verb.add_option("--record", arguments.record, "Write the commands to this file, which makes the same drive again")
      ->type_name("FILE.csv");
  verb.add_flag("--force", arguments.force, "Replace that file if it exists");
  add_whole(verb, "--page", arguments.page, 0, std::numeric_limits<std::uint16_t>::max(),
            "Serve a page that shows the robot in three dimensions and steers it, at this port of 127.0.0.1; 0: any")
      ->type_name("PORT");
  add_whole(verb, "--trial", arguments.trial.particles, 0, 100'000,
            "By how many particles a new gait is tried before the switch; 0: none")
      ->default_str("16");
  add_read_option(verb, "--horizon", "How far ahead they are simulated",
                  [&arguments](const std::string& text, const std::string& option) {
                    arguments.trial.horizon = parse_seconds(text, option, 1e-3, 1e6);
                    if (arguments.trial.horizon > 0) return;
                    throw InputError(
                        fmt::format("{} {}: in no time nothing is tried; nearest right answer: --trial 0, "
                                    "which switches without a trial",
                                    option, text));
                  })
      ->type_name("TIME")
      ->default_str("2 s");
  add_read_option(verb, "--accept", "The share of them that must violate no requirement, else the gait is refused",
                  [&arguments](const std::string& text, const std::string& option) {
                    arguments.trial.accept = read_share(text, option);
                  })
      ->type_name("SHARE")
      ->default_str("90 %");
}

}  // namespace

void add_drive(CLI::App& app, Action& action) {
  auto arguments = std::make_shared<DriveArguments>();
  CLI::App* verb = add_verb(
      app, "drive", "Drive a robot by the keyboard while it is simulated; a new gait is tried before the switch",
      "  graze drive quadruped_drive                        # arrow keys, 1 to 9 choose a gait, q ends\n"
      "  graze drive quadruped_drive --record drive.csv     # and write what was commanded\n"
      "  graze drive quadruped_drive --replay drive.csv     # the same commands again\n"
      "  graze drive quadruped_drive --page 0               # in a browser of this machine, with keys or a gamepad\n"
      "  printf '0 up\\n1 left\\n3 q\\n' | graze drive quadruped_drive\n\n"
      "Keys: up/down or W/S speed, left/right or A/D turn, ',' and '.' strafe, space stops, c steers like a car, + and "
      "- zoom.\ndocs/drive.md.\n");
  add_options(*verb, *arguments);
  verb->callback([arguments, &action] { action = [arguments] { return drive(*arguments); }; });
}

}  // namespace graze
