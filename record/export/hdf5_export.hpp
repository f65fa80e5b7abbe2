// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "record/log_clock.hpp"
#include "record/tick_log.hpp"

namespace kerf {

/// Writes the recording in `folder` as HDF5, for MATLAB (`h5read`), Octave, h5py, Julia and R.
/// Whole or not at all, in constant memory.
///
///   /ticks/COLUMN   one dataset per column of the log, of its type and its rows, in chunks of 1024
///                   rows, packed with deflate; attributes units, description with all codes or
///                   bits, valid (which rows it holds for) and, for codes and bits, codes
///   /ticks/time_ns  int64: UTC in ns since 1970 by `clock`, or `start_ns` if that has no date
///   /ticks_2/COLUMN of the second arm, if there is one; the same index is the same tick
///   /scene          the scene as JSON text, in ASCII
///   attributes of / kerf, tick_ns, session_id, end_reason, clock: of time_ns,
///                   "UTC" or "CLOCK_MONOTONIC"
///
/// A row has the same index in every dataset. Throws `RecordError`, also if the file cannot be
/// written.
void export_hdf5(const std::filesystem::path& folder, const std::filesystem::path& hdf5,
                 TickRange range = {}, const LogClock& clock = {});

}  // namespace kerf
