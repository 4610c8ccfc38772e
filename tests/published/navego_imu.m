% IMU noise for NaveGo, written by allanite VERSION
% from bench <b>7</b> & co.csv, SHA-256 9f2c4f4c5a0d9a5c0e0a64dd4cf1a0b5c9c1d5ee2a74a45a54c8fa9c1a3c9be1, 43200 s at 100.0 Hz
% continuous; raw units, then imu_si_errors, then densities in SI that this file sets itself
% gb_dyn, ab_dyn: stationary standard deviation of the Gauss-Markov bias; psd = sigma sqrt(2/T)
% arrw, vrrw: K; the simulator noise_rrw.m steps by K dt, not K sqrt(dt): too small by sqrt(rate)
% gb_sta, ab_sta: spread between power-ups, not in a record of one run: yours to set
% CAUTION: set gb_psd and ab_psd after imu_si_errors, in SI: NaveGo derives them from gb_dyn in different ways
% bias = first-order Gauss-Markov process: sigma its stationary standard deviation, T its time
% of flicker: sigma = 1.0760 B, the process with the same peak of the Allan deviation, with T = 100 s as given
% one number for all axes, from the worst axis for each parameter; not inflated
% B: IEEE Std 952 coefficient (floor of the Allan deviation / 0.664)
% [ ]: 95 % interval
% LEFT OUT: not in the numbers of this file
%
% gyroscope, N in rad/s/sqrt(Hz); B, sigma in rad/s; K in rad/s^2/sqrt(Hz):
%   gyro_x: N 8.7301e-05 [8.7127e-05, 8.7476e-05]; B 2.4725e-05 [2.2301e-05, 2.7150e-05]; sigma = 1.0760 B = 2.6605e-05, with T 100 s; K 7.7376e-07 [5.4105e-07, 1.0065e-06]
%   gyro_y: N 9.3121e-05 [9.2935e-05, 9.3308e-05]; B 2.0769e-05 [1.8733e-05, 2.2806e-05]; sigma = 1.0760 B = 2.2348e-05, with T 100 s; K < 6.3026e-07 (95 % upper limit, used)
%   gyro_y: N 9.3121e-05 [9.2935e-05, 9.3308e-05]; Gauss-Markov sigma 2.1910e-05 [2.0376e-05, 2.3882e-05], T 180 s [93.6, 309.6], with T 100 s and sigma 2.9395e-05, above the term at all averaging times; K < 1.8617e-07 (95 % upper limit, used)
%   gyro_y: the record cannot decide between these two; the larger numbers are used
%   gyro_z: N 7.8571e-05 [7.8414e-05, 7.8728e-05]; B 1.4835e-05 [1.3381e-05, 1.6290e-05]; sigma = 1.0760 B = 1.5963e-05, with T 100 s; K < 1.5708e-07 (95 % upper limit, used); Q 1.5514e-05 rad LEFT OUT
%
% accelerometer, N in m/s^2/sqrt(Hz); B, sigma in m/s^2; K in m/s^3/sqrt(Hz):
%   acc_x: N 5.0020e-04 [4.9920e-04, 5.0120e-04]; B 2.0006e-04 [1.8044e-04, 2.1967e-04]; sigma = 1.0760 B = 2.1526e-04, with T 100 s; K 6.9562e-06 [4.8641e-06, 9.0483e-06]
%   acc_y: N 4.6685e-04 [4.6592e-04, 4.6779e-04]; B 2.4007e-04 [2.1653e-04, 2.6360e-04]; sigma = 1.0760 B = 2.5831e-04, with T 100 s; K < 9.3333e-07 (95 % upper limit, used)
%   acc_z: N 6.8361e-04 [6.8224e-04, 6.8497e-04]; B < 7.5167e-06 (95 % upper limit, used); sigma = 1.0760 B = 8.0879e-06, with T 100 s; K < 1.3667e-06 (95 % upper limit, used)

imu.arw = [3.201280e-01, 3.201280e-01, 3.201280e-01];  % deg/sqrt(h)
imu.gb_dyn = [1.684206e-03, 1.684206e-03, 1.684206e-03];  % deg/s
imu.gb_corr = [1.000000e+02, 1.000000e+02, 1.000000e+02];  % s
imu.vrw = [4.101640e-02, 4.101640e-02, 4.101640e-02];  % m/s/sqrt(h)
imu.ab_dyn = [2.634042e-02, 2.634042e-02, 2.634042e-02];  % mg
imu.ab_corr = [1.000000e+02, 1.000000e+02, 1.000000e+02];  % s

% imu = imu_si_errors(imu, dt);  % with the rest of the structure filled in; then:

imu.gb_psd = [4.157073e-06, 4.157073e-06, 4.157073e-06];  % rad/s^2/sqrt(Hz)
imu.arrw = [7.737626e-07, 7.737626e-07, 7.737626e-07];  % rad/s^2/sqrt(Hz)
imu.ab_psd = [3.653073e-05, 3.653073e-05, 3.653073e-05];  % m/s^3/sqrt(Hz)
imu.vrrw = [6.956184e-06, 6.956184e-06, 6.956184e-06];  % m/s^3/sqrt(Hz)
