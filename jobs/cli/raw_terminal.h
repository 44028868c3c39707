#pragma once
// A terminal in the hands of one program: keys come as they are pressed, the whole screen is drawn. It is put back on
// every way out that a program can see: the end of the object, SIGINT, SIGTERM, SIGHUP, SIGQUIT, Ctrl-Z, crashes.

#include <string>

namespace graze {

class RawTerminal {
 public:
  /// Takes the terminal of standard input and output. One at a time. `here` false: there is none, so that nothing is
  /// read or drawn, but the signals are minded. Throws MachineError if there is none that should be.
  explicit RawTerminal(bool here = true);
  ~RawTerminal();
  RawTerminal(const RawTerminal&) = delete;
  RawTerminal& operator=(const RawTerminal&) = delete;

  struct Size {
    int columns, rows;
  };
  Size size() const;
  /// Bytes of keys that were pressed, waited for no longer than `seconds`; "": none. False: there is no terminal any
  /// more.
  bool read(double seconds, std::string& keys);
  /// Draws lines from the top; those that are too long or too many are cut.
  void draw(const std::string& lines);
  /// The signal that asks the program to end (SIGINT, SIGTERM, SIGHUP, SIGQUIT); 0: none. A second one ends it at once.
  int asked_to_end() const;
  /// Whether Ctrl-Z has been pressed: gives the terminal back, stops the program, and takes it again when it goes on.
  bool stopped_and_went_on();

 private:
  void take();

  const bool here_;
};

}  // namespace graze
