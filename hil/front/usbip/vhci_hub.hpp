// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace kerf {

/// Plugs a full-speed device into a free port of the kernel's virtual USB host controller (module
/// vhci-hcd) and returns the device's end of the cable, a stream socket that speaks USB/IP. The
/// caller closes it, which unplugs the device. Throws `HilError` where the module, the right (root)
/// or a free port is missing.
[[nodiscard]] int plug_into_vhci();

}  // namespace kerf
