#include "jobs/cli/drive_page.h"

#include <utility>

#include "analysis/report_data.h"
#include "jobs/campaign/page_scene.h"

namespace graze {

std::string drive_page_data(DriveSession& session, const Scenario& scenario) {
  const TraceFrames frame = session.frame();
  const Json trace = {{"policy", session.policies()[session.policy()]},
                      {"outcome", outcome_name(Outcome::success)},
                      {"time", {frame.time.front()}},
                      {"bodies", bodies_json(frame, NumberForm::plain)}};
  return script_json({{"kind", "drive"},
                      {"title", scenario.name},
                      {"lead", scenario.description},
                      {"notes", Json::array()},
                      {"policies", session.policies()},
                      {"scene", scene_json(session.robot().model, NumberForm::plain)},
                      {"trajectories", {trace}}});
}

std::string drive_page_frame(DriveSession& session, const DriveTelling& telling) {
  Json bodies = bodies_json(session.frame(), NumberForm::plain);
  bodies.erase("shapes");  // they stay
  bodies.erase("grounds");
  const DriveSight& sight = session.sight();
  const CommandRow& command = session.command();
  const Json tried = session.tried() ? Json(*session.tried()) : Json(nullptr);
  const Json frame = {{"time", sight.time},
                      {"bodies", std::move(bodies)},
                      {"policy", session.policy()},
                      {"tried", tried},
                      {"command", {command.forward, command.strafe, command.turn}},
                      {"velocity", {sight.velocity.x(), sight.velocity.y(), sight.velocity.z()}},
                      {"height", sight.position.z()},
                      {"tilt", sight.tilt},
                      {"pace", telling.pace},
                      {"car", telling.car},
                      {"ended", telling.ended},
                      {"message", telling.message}};
  return frame.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace graze
