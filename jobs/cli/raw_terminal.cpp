#include "jobs/cli/raw_terminal.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>

#include "archive/files/utf8.h"
#include "engine/settings/settings.h"

namespace graze {
namespace {

// What handlers of signals need; they may call tcsetattr, write and sigaction.
termios terminal_before;
volatile std::sig_atomic_t terminal_taken = 0, end_signal = 0, stop_asked = 0;

constexpr std::array kEndSignals = {SIGINT, SIGTERM, SIGHUP, SIGQUIT};
constexpr std::array kFatalSignals = {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT};
std::array<struct sigaction, kEndSignals.size()> end_actions;
std::array<struct sigaction, kFatalSignals.size()> fatal_actions;
struct sigaction stop_action;

// The alternative screen, without a cursor; lines are not wrapped.
constexpr char kTakeScreen[] = "\x1b[?1049h\x1b[?25l\x1b[?7l\x1b[2J", kGiveScreen[] = "\x1b[?7h\x1b[?25h\x1b[?1049l";

bool write_screen(const char* text, std::size_t size) {
  while (size > 0) {
    const ssize_t written = ::write(STDOUT_FILENO, text, size);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return false;
    text += written;
    size -= static_cast<std::size_t>(written);
  }
  return true;
}

void give_terminal() {
  if (!terminal_taken) return;
  terminal_taken = 0;
  write_screen(kGiveScreen, sizeof kGiveScreen - 1);
  tcsetattr(STDIN_FILENO, TCSANOW, &terminal_before);
}

void note_end(int number) {
  if (end_signal == 0) {
    end_signal = number;
    return;
  }
  give_terminal();
  std::signal(number, SIG_DFL);
  raise(number);
}

void note_stop(int) { stop_asked = 1; }

/// Whoever handled the signal before goes on with it.
void give_and_pass_on(int number) {
  give_terminal();
  for (std::size_t i = 0; i < kFatalSignals.size(); ++i) {
    if (kFatalSignals[i] == number) sigaction(number, &fatal_actions[i], nullptr);
  }
  raise(number);
}

struct sigaction handled_by(void (*handler)(int)) {
  struct sigaction out {};
  out.sa_handler = handler;
  sigemptyset(&out.sa_mask);
  return out;
}

}  // namespace

RawTerminal::RawTerminal(bool here) : here_(here) {
  if (here_ && tcgetattr(STDIN_FILENO, &terminal_before) != 0) {
    throw MachineError(std::string("standard input: is no terminal: ") + std::strerror(errno));
  }
  end_signal = 0;
  stop_asked = 0;
  const struct sigaction end = handled_by(note_end), fatal = handled_by(give_and_pass_on), stop = handled_by(note_stop);
  for (std::size_t i = 0; i < kFatalSignals.size(); ++i) sigaction(kFatalSignals[i], &fatal, &fatal_actions[i]);
  for (std::size_t i = 0; i < kEndSignals.size(); ++i) sigaction(kEndSignals[i], &end, &end_actions[i]);
  sigaction(SIGTSTP, &stop, &stop_action);
  take();
}

RawTerminal::~RawTerminal() {
  give_terminal();
  for (std::size_t i = 0; i < kFatalSignals.size(); ++i) sigaction(kFatalSignals[i], &fatal_actions[i], nullptr);
  for (std::size_t i = 0; i < kEndSignals.size(); ++i) sigaction(kEndSignals[i], &end_actions[i], nullptr);
  sigaction(SIGTSTP, &stop_action, nullptr);
}

void RawTerminal::take() {
  if (!here_) return;
  termios raw = terminal_before;
  raw.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);  // Ctrl-C and Ctrl-Z stay signals
  raw.c_iflag &= ~static_cast<tcflag_t>(IXON);
  raw.c_cc[VMIN] = 0;
  raw.c_cc[VTIME] = 0;
  terminal_taken = 1;  // before it is changed: a signal in between puts back what it was
  tcsetattr(STDIN_FILENO, TCSANOW, &raw);
  write_screen(kTakeScreen, sizeof kTakeScreen - 1);
}

RawTerminal::Size RawTerminal::size() const {
  winsize window{};
  constexpr Size kUsual = {80, 24};
  if (ioctl(STDOUT_FILENO, TIOCGWINSZ, &window) != 0 || window.ws_col == 0 || window.ws_row == 0) return kUsual;
  return {window.ws_col, window.ws_row};
}

bool RawTerminal::read(double seconds, std::string& keys) {
  keys.clear();
  pollfd wait = {STDIN_FILENO, POLLIN, 0};
  constexpr double kMilliseconds = 1e3;
  if (poll(&wait, here_ ? 1 : 0, seconds > 0 ? static_cast<int>(seconds * kMilliseconds) : 0) <= 0) return true;
  if ((wait.revents & POLLIN) == 0) return (wait.revents & (POLLHUP | POLLERR | POLLNVAL)) == 0;
  std::array<char, 256> buffer;
  const ssize_t size = ::read(STDIN_FILENO, buffer.data(), buffer.size());
  if (size < 0) return errno == EINTR || errno == EAGAIN;
  keys.assign(buffer.data(), static_cast<std::size_t>(size));
  return size > 0;
}

void RawTerminal::draw(const std::string& lines) {
  if (!here_) return;
  std::string out = "\x1b[H";
  int row = 0;
  const int rows = size().rows;
  for (std::size_t begin = 0; begin < lines.size() && row < rows; ++row) {
    const std::size_t end = std::min(lines.find('\n', begin), lines.size());
    out += (row > 0 ? "\r\n" : "") + printable(lines.substr(begin, end - begin)) + "\x1b[K";
    begin = end + 1;
  }
  out += "\x1b[J";
  write_screen(out.data(), out.size());
}

int RawTerminal::asked_to_end() const { return end_signal; }

bool RawTerminal::stopped_and_went_on() {
  if (!stop_asked) return false;
  stop_asked = 0;
  give_terminal();
  raise(SIGSTOP);
  take();
  return true;
}

}  // namespace graze
