#pragma once
// What the page of `graze drive --page` is given: the robot and its world once, then frame by frame.

#include <string>

#include "jobs/campaign/drive_session.h"

namespace graze {

/// The page's data (script_json()), with the robot as it is now.
std::string drive_page_data(DriveSession& session, const Scenario& scenario);

/// What there is to tell beside the robot.
struct DriveTelling {
  double pace = 1;  // of real time
  bool car = false;
  bool ended = false;
  std::string message = {};
};
/// One frame, JSON in one line. Of the session's frames this one is taken.
std::string drive_page_frame(DriveSession& session, const DriveTelling& telling);

}  // namespace graze
