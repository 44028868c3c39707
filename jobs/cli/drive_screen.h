#pragma once
// What a terminal shows of a robot that is driven: numbers, and the world from above, north (+x) up.

#include <string>
#include <vector>

#include "jobs/campaign/drive_session.h"

namespace graze {

class DriveScreen {
 public:
  /// `scenario` outlives this.
  explicit DriveScreen(const Scenario& scenario);

  /// Lines that fit a screen. `pace`: of real time, 1 or less; `message`: the last thing to tell.
  std::string lines(const DriveSession& session, int columns, int rows, double pace, bool car,
                    const std::string& message);
  /// Makes what is seen of the world smaller or larger.
  void zoom(double factor);

 private:
  std::string map(const DriveSight& sight, int columns, int rows);
  void remember(const DriveSight& sight);

  const Scenario& scenario_;
  std::vector<Vec3> waypoints_, path_;
  double reach_ = 0;  // m, of the feet from the base
  double zoom_ = 1;
};

}  // namespace graze
