// Keys of the keyboard for ImGui, whose numbers were the window library's before ImGui 1.87.
#pragma once

#include <GLFW/glfw3.h>
#include <imgui.h>

namespace luxfield::view {

#if IMGUI_VERSION_NUM >= 18700
using Key = ImGuiKey;
#define LUXFIELD_KEY(imgui, glfw) ImGuiKey_##imgui
#else
using Key = int;
#define LUXFIELD_KEY(imgui, glfw) GLFW_KEY_##glfw
#endif

namespace key {
inline constexpr Key kW = LUXFIELD_KEY(W, W), kA = LUXFIELD_KEY(A, A), kS = LUXFIELD_KEY(S, S),
                     kD = LUXFIELD_KEY(D, D), kE = LUXFIELD_KEY(E, E), kQ = LUXFIELD_KEY(Q, Q),
                     kR = LUXFIELD_KEY(R, R), kH = LUXFIELD_KEY(H, H), kZ = LUXFIELD_KEY(Z, Z),
                     kY = LUXFIELD_KEY(Y, Y), k1 = LUXFIELD_KEY(1, 1), k2 = LUXFIELD_KEY(2, 2),
                     k3 = LUXFIELD_KEY(3, 3), k4 = LUXFIELD_KEY(4, 4), k5 = LUXFIELD_KEY(5, 5),
                     kL = LUXFIELD_KEY(L, L), kG = LUXFIELD_KEY(G, G),
                     kPlus = LUXFIELD_KEY(Equal, EQUAL), kMinus = LUXFIELD_KEY(Minus, MINUS),
                     kPadPlus = LUXFIELD_KEY(KeypadAdd, KP_ADD),
                     kPadMinus = LUXFIELD_KEY(KeypadSubtract, KP_SUBTRACT),
                     kDelete = LUXFIELD_KEY(Delete, DELETE), kF1 = LUXFIELD_KEY(F1, F1),
                     kEscape = LUXFIELD_KEY(Escape, ESCAPE);
}  // namespace key

#undef LUXFIELD_KEY

}  // namespace luxfield::view
