/* SPDX-License-Identifier: Apache-2.0 */
/* The HD interface of kerf's stand-in for OpenHaptics, in C and C++: types, numbers and functions
   that programs are compiled with, declared by kerf from published documents (docs/stand-ins.md).
   No file of the vendor's. Link with -lHD. */
#ifndef KERF_STAND_IN_HD_H
#define KERF_STAND_IN_HD_H

#ifdef __cplusplus
extern "C" {
#endif

#define HDAPI
#define HDAPIENTRY
#define HDCALLBACK

typedef int HDint;
typedef unsigned int HDuint;
typedef unsigned char HDboolean;
typedef unsigned short HDushort;
typedef long HDlong;
typedef unsigned long HDulong;
typedef float HDfloat;
typedef double HDdouble;
typedef char HDchar;
typedef const char* HDstring;
typedef unsigned int HDenum;
typedef unsigned int HDerror;
typedef unsigned int HHD;
typedef unsigned int HDCallbackCode;
typedef unsigned int HDWaitCode;
typedef unsigned long HDSchedulerHandle;
typedef HDCallbackCode(HDCALLBACK* HDSchedulerCallback)(void* user_data);

/* 12 bytes, returned by value. */
typedef struct {
  HDerror errorCode;
  int internalErrorCode;
  HHD hHD;
} HDErrorInfo;

#define HD_FALSE 0
#define HD_TRUE 1
#define HD_DEFAULT_DEVICE ((HDstring)0)
#define HD_INVALID_HANDLE 0xFFFFFFFF

/* Errors. */
#define HD_SUCCESS 0x0000
#define HD_INVALID_ENUM 0x0100
#define HD_INVALID_VALUE 0x0101
#define HD_INVALID_OPERATION 0x0102
#define HD_INVALID_INPUT_TYPE 0x0103
#define HD_BAD_HANDLE 0x0104
#define HD_WARM_MOTORS 0x0200
#define HD_EXCEEDED_MAX_FORCE 0x0201
#define HD_EXCEEDED_MAX_FORCE_IMPULSE 0x0202
#define HD_EXCEEDED_MAX_VELOCITY 0x0203
#define HD_FORCE_ERROR 0x0204
#define HD_DEVICE_FAULT 0x0300
#define HD_DEVICE_ALREADY_INITIATED 0x0301
#define HD_COMM_ERROR 0x0302
#define HD_COMM_CONFIG_ERROR 0x0303
#define HD_TIMER_ERROR 0x0304
#define HD_ILLEGAL_BEGIN 0x0400
#define HD_ILLEGAL_END 0x0401
#define HD_FRAME_ERROR 0x0402
#define HD_INVALID_PRIORITY 0x0500
#define HD_SCHEDULER_FULL 0x0501
#define HD_INVALID_LICENSE 0x0600
/* Whether an HDErrorInfo is an error. */
#define HD_DEVICE_ERROR(info) ((info).errorCode != HD_SUCCESS)

/* Readings of a frame: units mm, mm/s, rad, N, mNm. */
#define HD_CURRENT_BUTTONS 0x2000
#define HD_CURRENT_SAFETY_SWITCH 0x2001
#define HD_CURRENT_INKWELL_SWITCH 0x2002
#define HD_CURRENT_ENCODER_VALUES 0x2010
#define HD_CURRENT_PINCH_VALUE 0x2011
#define HD_LAST_PINCH_VALUE 0x2012
#define HD_CURRENT_POSITION 0x2050
#define HD_CURRENT_VELOCITY 0x2051
#define HD_CURRENT_TRANSFORM 0x2052
#define HD_CURRENT_ANGULAR_VELOCITY 0x2053
#define HD_CURRENT_JACOBIAN 0x2054
#define HD_CURRENT_JOINT_ANGLES 0x2100
#define HD_CURRENT_GIMBAL_ANGLES 0x2150
#define HD_LAST_BUTTONS 0x2200
#define HD_LAST_SAFETY_SWITCH 0x2201
#define HD_LAST_INKWELL_SWITCH 0x2202
#define HD_LAST_ENCODER_VALUES 0x2210
#define HD_LAST_POSITION 0x2250
#define HD_LAST_VELOCITY 0x2251
#define HD_LAST_TRANSFORM 0x2252
#define HD_LAST_ANGULAR_VELOCITY 0x2253
#define HD_LAST_JACOBIAN 0x2254
#define HD_LAST_JOINT_ANGLES 0x2300
#define HD_LAST_GIMBAL_ANGLES 0x2350

/* The device. */
#define HD_VERSION 0x2500
#define HD_DEVICE_MODEL_TYPE 0x2501
#define HD_DEVICE_DRIVER_VERSION 0x2502
#define HD_DEVICE_VENDOR 0x2503
#define HD_DEVICE_SERIAL_NUMBER 0x2504
#define HD_DEVICE_FIRMWARE_VERSION 0x2505
#define HD_MAX_WORKSPACE_DIMENSIONS 0x2550
#define HD_USABLE_WORKSPACE_DIMENSIONS 0x2551
#define HD_TABLETOP_OFFSET 0x2552
#define HD_INPUT_DOF 0x2553
#define HD_OUTPUT_DOF 0x2554
#define HD_CALIBRATION_STYLE 0x2555
#define HD_UPDATE_RATE 0x2600
#define HD_INSTANTANEOUS_UPDATE_RATE 0x2601
#define HD_NOMINAL_MAX_STIFFNESS 0x2602
#define HD_NOMINAL_MAX_FORCE 0x2603
#define HD_NOMINAL_MAX_CONTINUOUS_FORCE 0x2604
#define HD_MOTOR_TEMPERATURE 0x2605
#define HD_SOFTWARE_VELOCITY_LIMIT 0x2606
#define HD_SOFTWARE_FORCE_IMPULSE_LIMIT 0x2607
#define HD_FORCE_RAMPING_RATE 0x2608
#define HD_NOMINAL_MAX_DAMPING 0x2609
#define HD_NOMINAL_MAX_TORQUE_STIFFNESS 0x2620
#define HD_NOMINAL_MAX_TORQUE_DAMPING 0x2621
#define HD_NOMINAL_MAX_TORQUE_FORCE 0x2622
#define HD_NOMINAL_MAX_TORQUE_CONTINUOUS_FORCE 0x2623

/* What a program sets. */
#define HD_CURRENT_FORCE 0x2700
#define HD_CURRENT_TORQUE 0x2701
#define HD_JOINT_ANGLE_REFERENCES 0x2702
#define HD_CURRENT_JOINT_TORQUE 0x2703
#define HD_CURRENT_GIMBAL_TORQUE 0x2704
#define HD_CURRENT_MOTOR_DAC_VALUES 0x2750
#define HD_LAST_FORCE 0x2800
#define HD_LAST_TORQUE 0x2801
#define HD_LAST_JOINT_TORQUE 0x2802
#define HD_LAST_GIMBAL_TORQUE 0x2803
#define HD_LAST_MOTOR_DAC_VALUES 0x2850
#define HD_USER_STATUS_LIGHT 0x2900

/* Capabilities; the limits of velocity and impulse are some, too. */
#define HD_FORCE_OUTPUT 0x4000
#define HD_MAX_FORCE_CLAMPING 0x4001
#define HD_FORCE_RAMPING 0x4002
#define HD_SOFTWARE_FORCE_LIMIT 0x4003
#define HD_ONE_FRAME_LIMIT 0x4004

#define HD_CALIBRATION_OK 0x5000
#define HD_CALIBRATION_NEEDS_UPDATE 0x5001
#define HD_CALIBRATION_NEEDS_MANUAL_INPUT 0x5002
#define HD_CALIBRATION_ENCODER_RESET 1
#define HD_CALIBRATION_AUTO 2
#define HD_CALIBRATION_INKWELL 4

#define HD_DEVICE_BUTTON_1 1
#define HD_DEVICE_BUTTON_2 2
#define HD_DEVICE_BUTTON_3 4
#define HD_DEVICE_BUTTON_4 8

#define HD_CALLBACK_DONE 0
#define HD_CALLBACK_CONTINUE 1
#define HD_WAIT_CHECK_STATUS 0
#define HD_WAIT_INFINITE 1
#define HD_MIN_SCHEDULER_PRIORITY 0
#define HD_MAX_SCHEDULER_PRIORITY 0xFFFF
#define HD_DEFAULT_SCHEDULER_PRIORITY 0x7FFF

/* Devices and frames. */
HHD hdInitDevice(HDstring name);
void hdDisableDevice(HHD device);
void hdMakeCurrentDevice(HHD device);
HHD hdGetCurrentDevice(void);
void hdBeginFrame(HHD device);
void hdEndFrame(HHD device);
HDErrorInfo hdGetError(void);
HDstring hdGetErrorString(HDerror code);

/* Capabilities and parameters. */
void hdEnable(HDenum capability);
void hdDisable(HDenum capability);
HDboolean hdIsEnabled(HDenum capability);
void hdGetBooleanv(HDenum name, HDboolean* out);
void hdGetIntegerv(HDenum name, HDint* out);
void hdGetFloatv(HDenum name, HDfloat* out);
void hdGetDoublev(HDenum name, HDdouble* out);
void hdGetLongv(HDenum name, HDlong* out);
void hdSetBooleanv(HDenum name, const HDboolean* in);
void hdSetIntegerv(HDenum name, const HDint* in);
void hdSetFloatv(HDenum name, const HDfloat* in);
void hdSetDoublev(HDenum name, const HDdouble* in);
void hdSetLongv(HDenum name, const HDlong* in);
HDstring hdGetString(HDenum name);

/* Calibration and licence. */
HDenum hdCheckCalibration(void);
void hdUpdateCalibration(HDenum style);
HDenum hdCheckCalibrationStyle(void);
void hdUpdateCalibrationMessage(HDenum style);
void hdScaleGimbalAngles(HDdouble x, HDdouble y, HDdouble z, HDdouble* transform);
HDboolean hdDeploymentLicense(HDstring vendor, HDstring program, HDstring password);

/* The scheduler. */
void hdStartScheduler(void);
void hdStopScheduler(void);
void hdSetSchedulerRate(HDulong hertz);
void hdScheduleSynchronous(HDSchedulerCallback callback, void* user_data, HDushort priority);
HDSchedulerHandle hdScheduleAsynchronous(HDSchedulerCallback callback, void* user_data,
                                         HDushort priority);
void hdUnschedule(HDSchedulerHandle handle);
HDboolean hdWaitForCompletion(HDSchedulerHandle handle, HDWaitCode how);
HDdouble hdGetSchedulerTimeStamp(void);

#ifdef __cplusplus
}
#endif
#endif
