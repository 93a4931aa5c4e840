#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "output/row_file.h"
#include "scenario/scenario.h"
#include "simulation/simulation.h"

namespace cb {

inline constexpr std::string_view contacts_header = "t,step,a,b,px,py,pz,nx,ny,nz,ux,uy,uz,rx,ry,rz,mode\n";
inline constexpr std::string_view hulls_header = "shape,face,x,y,z\n";
inline constexpr std::string_view shapes_header = "shape,body,kind,px,py,pz,qw,qx,qy,qz,radius,hx,hy,hz\n";

/// What a contact does after an event.
enum class ContactMode { open, stick, slip };
std::string_view name(ContactMode mode);

/// Of impulses r (N s) and velocities u (m/s) of one contact, each n, t1, t2. Open: its normal impulse is at most
/// `mode_tolerance` of the event's largest. Stick: its tangential velocity is at most that of the event's largest
/// speed, before or after. A looser value calls creep stick, a sharper one what a solver leaves open slip.
ContactMode contact_mode(const double* r, const double* u, double largest_impulse, double largest_speed);
inline constexpr double mode_tolerance = 1e-6;  // -

/// contacts.csv, a row for each contact of each event of the steps that are recorded, and shapes.csv, the shapes of the
/// scene as they sit on their bodies: what it takes to draw a run (docs/files.md). Does not allocate once it has seen
/// the largest event.
class ContactFile {
 public:
  /// `every`: rows of each `every`-th step. `wanted` = false: writes nothing, and removes what an earlier run left.
  ContactFile(const std::filesystem::path& directory, const Scenario& scenario, bool wanted, long every);

  bool ok() const { return error() == 0; }
  /// errno of the first failure, 0 where there is none.
  int error() const { return error_ != 0 ? error_ : contacts_ ? contacts_->error() : 0; }
  /// Of the file of that failure.
  const std::string& failed_path() const { return error_ != 0 ? failed_path_ : contacts_->path(); }

  /// An event of the step after the last one that was given to step().
  void event(const EventRecord& event);
  void step(const StepRecord& record) { step_ = record.step + 1; }
  void flush() {
    if (contacts_) contacts_->flush();
  }

 private:
  const Scenario& scenario_;
  long every_, step_ = 1;
  std::vector<std::string> names_;  // per shape, as a cell
  std::vector<double> u_before_, u_;
  std::optional<RowFile> contacts_;
  int error_ = 0;            // errno of shapes.csv or hulls.csv
  std::string failed_path_;  // which of them
};

}  // namespace cb
