% The envelope of an averaged event, in Octave: `afmid run examples/plugins/envelope.toml --allow-plugins`.
%
% The magnitude of the analytic signal: the transform's negative frequencies are left out. A mode that rings alone leaves exp(-t / tau), tau = Q / (pi f).
% Source: D. Gabor, J. IEE 93 (1946) 429.
1;

function outputs = analytic(inputs, parameters, context)
  average = inputs.average;
  signal = average.variables(1);
  y = signal.values(:);
  n = numel(y);
  if parameters.level_samples > n
    error("level_samples is %d, wanted at most %d, the samples of the event", parameters.level_samples, n);
  end
  % what it ends on is no ringing
  y = y - mean(y(end - parameters.level_samples + 1:end));
  spectrum = fft(y);
  weight = zeros(n, 1);
  weight(1) = 1;
  weight(2:ceil(n / 2)) = 2;
  if mod(n, 2) == 0
    weight(n / 2 + 1) = 1;
  end
  made = struct("attributes", struct());
  made.axes = average.axes(strcmp({average.axes.name}, signal.dims{1}));
  made.variables = struct("name", "envelope", "unit", signal.unit, "long_name", "magnitude of the analytic signal", ...
                          "dims", {signal.dims}, "values", abs(ifft(spectrum .* weight)));
  outputs = struct("envelope", made);
end

function all = examples_of()
  t = (0:255)' * 2e-7;
  axes = struct("name", "time", "unit", "s", "long_name", "time", "values", t);
  y = exp(-t / 1e-5) .* cos(2 * pi * 2.5e5 * t);
  variables = struct("name", "mean", "unit", "V", "long_name", "a ringdown", "dims", {{"time"}}, "values", y);
  average = struct("axes", axes, "variables", variables, "attributes", struct());
  all = {struct("title", "a ringdown", "parameters", struct("level_samples", 16), "inputs", struct("average", average))};
end

addpath(fullfile(fileparts(mfilename("fullpath")), "..", "..", "octave"));
about = struct("name", "envelope", "version", "1", "summary", "Envelope of an averaged event by its analytic signal", ...
               "source", "D. Gabor, J. IEE 93 (1946) 429", "deterministic", true, "seeded", false);
about.inputs = {struct("name", "average", "shape", "array", "tag", "average", "doc", "the averaged event; its first variable is used")};
about.outputs = {struct("name", "envelope", "shape", "array", "tag", "envelope", "doc", "magnitude of the analytic signal")};
about.parameters = struct("level_samples", struct("type", "integer", "minimum", 1, "default", 512, "description", "samples at the end whose mean is the level that it ends on"));
about.examples = examples_of();
afmid_stage(about, @analytic);
