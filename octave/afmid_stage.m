function afmid_stage(about, run)
% AFMID_STAGE  Serves a stage of afmid written in Octave or MATLAB.
%
%   afmid_stage(about, @run) speaks afmid's plugin protocol (docs/plugins.md) on stdin and stdout until `shutdown`.
%
%   about: a struct with the fields
%     name, version, summary    texts
%     inputs, outputs           cells of structs: name, shape ("array", "table", "state_space", "document"; inputs also
%                               "recording"), and optionally tag, doc, optional, finite
%     parameters                a struct of structs, one per parameter: JSON Schema, such as
%                               struct("type", "number", "minimum", 0, "default", 1)
%     deterministic, seeded     true or false
%     examples                  optional: a cell of structs with title, parameters, inputs (artifacts as below)
%
%   outputs = run(inputs, parameters, context): structs by port name. An array is a struct with
%     axes        struct array: name, unit, long_name, values (column)
%     variables   struct array: name, unit, long_name, dims (cell of axis names, slowest first), values (of that size)
%     attributes  struct of scalars
%   a table has columns (struct array: name, unit, long_name, values) and attributes; a state-space model A, B, C, D, K,
%   x0, sample_time_s, innovation_variance; a document is a struct with the one field value; recordings are structs as
%   in the protocol.
%   context: seed, base, warn(text) (a function).
%
%   An error() in run fails that item alone; its text is shown. Write nothing to stdout: use fprintf(stderr, ...).
%
%   Numbers go through HDF5: load reads the plain datasets that afmid writes, and save("-hdf5") writes PATH/value, which
%   the answer names. Tested under Octave 7.3. In MATLAB, which has no such save, replace read_file and write_file by
%   h5read, h5create and h5write.

  schema = struct("type", "object", "additionalProperties", false, "properties", about.parameters);
  names = fieldnames(about.parameters);
  schema.required = names(cellfun(@(n) ! isfield(about.parameters.(n), "default"), names))';
  say(struct("afmid_stage", 1, "protocol", struct("min", 1, "max", 1), "name", about.name, "version", about.version));
  while true
    % fgetl would wait for the byte behind the line
    line = fscanf(stdin, "%[^\n]");
    if isempty(line)
      break
    end
    fread(stdin, 1);
    request = jsondecode(line);
    if strcmp(request.method, "shutdown")
      break
    end
    try
      result = answer(request, about, schema, run);
      say(struct("id", request.id, "result", result));
    catch problem
      say(struct("id", request.id, "error", struct("message", problem.message)));
    end
  end
end

function result = answer(request, about, schema, run)
  switch request.method
    case "describe"
      result = describe(about, schema);
    case "run"
      result = run_item(request.params, about, run);
    otherwise
      error("there is no method `%s`", request.method);
  end
end

function result = describe(about, schema)
  result = about;
  result.parameters = schema;
  if isfield(about, "examples")
    for k = 1:numel(about.examples)
      example = about.examples{k};
      ports = fieldnames(example.inputs);
      sent = struct();
      for p = 1:numel(ports)
        sent.(ports{p}) = give(example.inputs.(ports{p}), []);
      end
      example.inputs = sent;
      result.examples{k} = example;
    end
  end
end

function result = run_item(params, about, run)
  given = fieldnames(params.parameters)';
  for name = given
    if ! isfield(about.parameters, name{1})
      error("there is no parameter `%s`; there is: %s", name{1}, strjoin(fieldnames(about.parameters)', ", "));
    end
  end
  for k = 1:numel(about.inputs)
    port = about.inputs{k};
    if ! (isfield(port, "optional") && port.optional) && ! isfield(params.inputs, port.name)
      error("nothing is wired to the input `%s`", port.name);
    end
  end
  inputs = struct();
  for name = fieldnames(params.inputs)'
    inputs.(name{1}) = take(params.inputs.(name{1}));
  end
  warned("clear");
  context = struct("seed", params.seed, "base", params.base, "warn", @(text) warned("add", text));
  made = run(inputs, params.parameters, context);
  file = struct("path", params.output, "numbers", struct());
  outputs = struct();
  for name = fieldnames(made)'
    [outputs.(name{1}), file] = give(made.(name{1}), file);
  end
  write_file(file);
  result.outputs = outputs;
  result.warnings = warned("get");
end

% The warnings of the item at hand.
function all = warned(what, text)
  persistent kept
  switch what
    case "clear"
      kept = {};
    case "add"
      kept{end + 1} = text;
  end
  all = kept;
end

% ---- from lines and files to structs

function made = take(sent)
  data = [];
  if isfield(sent, "file")
    data = read_file(sent.file);
  end
  switch sent.shape
    case "array"
      made = struct("attributes", sent.attributes);
      axes = cells(sent.axes);
      for k = 1:numel(axes)
        values = numbers(axes{k}.values, data)(:);
        made.axes(k) = struct("name", axes{k}.name, "unit", axes{k}.unit, "long_name", axes{k}.long_name, ...
                              "values", values);
        lengths.(axes{k}.name) = axes{k}.length;
      end
      variables = cells(sent.variables);
      for k = 1:numel(variables)
        one = variables{k};
        if strcmp(one.kind, "complex")
          values = complex(numbers(one.re, data), numbers(one.im, data));
        else
          values = numbers(one.values, data);
        end
        dims = cells(one.dims);
        sizes = cellfun(@(d) lengths.(d), dims);
        made.variables(k) = struct("name", one.name, "unit", one.unit, "long_name", one.long_name, "dims", {dims}, ...
                                   "values", rows_first(values, sizes));
      end
    case "table"
      made = struct("attributes", sent.attributes);
      columns = cells(sent.columns);
      for k = 1:numel(columns)
        one = columns{k};
        if strcmp(one.kind, "text")
          values = cells(one.values);
        else
          values = numbers(one.values, data)(:);
        end
        made.columns(k) = struct("name", one.name, "unit", one.unit, "long_name", one.long_name, "values", {values});
      end
    case "state_space"
      made = sent;
      sizes = struct("A", [sent.states sent.states], "B", [sent.states sent.inputs], ...
                     "C", [sent.outputs sent.states], "D", [sent.outputs sent.inputs], ...
                     "K", [sent.states sent.outputs], "x0", [sent.states 1]);
      for name = fieldnames(sizes)'
        made.(name{1}) = rows_first(numbers(sent.matrices.(name{1}), data), sizes.(name{1}));
      end
    otherwise
      made = sent;
  end
end

% Numbers of a path in a loaded file, or of the line.
function values = numbers(where, data)
  if ischar(where)
    values = data;
    for step = strsplit(where(2:end), "/")
      values = values.(step{1});
    end
    values = double(values);
  else
    values = where;
  end
end

% HDF5 and the protocol are row-major: read as columns, the sizes come reversed.
function values = rows_first(values, sizes)
  sizes = sizes(:)';
  if numel(sizes) < 2
    values = values(:);
  else
    values = permute(reshape(values, fliplr(sizes)), numel(sizes):-1:1);
  end
end

function values = columns_first(values, count)
  if count >= 2
    values = permute(values, count:-1:1);
  end
  values = values(:);
end

% jsondecode makes struct arrays, columns and cells of lists: a cell in any case.
function list = cells(list)
  if ischar(list)
    list = {list};
  elseif isempty(list)
    list = {};
  elseif ! iscell(list)
    list = num2cell(list);
  end
end

function data = read_file(path)
  data = load("-hdf5", path);
end

% ---- from structs to lines and files

function [sent, file] = give(made, file)
  if isfield(made, "axes")
    sent = struct("shape", "array");
    sent.axes = {};
    for k = 1:numel(made.axes)
      one = made.axes(k);
      [one.values, file] = put(one.values(:), file);
      one.length = numel(made.axes(k).values);
      sent.axes{k} = one;
    end
    sent.variables = {};
    for k = 1:numel(made.variables)
      one = made.variables(k);
      count = numel(one.dims);
      values = one.values;
      one = rmfield(one, "values");
      if iscomplex(values)
        one.kind = "complex";
        [one.re, file] = put(columns_first(real(values), count), file);
        [one.im, file] = put(columns_first(imag(values), count), file);
      else
        one.kind = "real";
        if isinteger(values)
          one.kind = "integer";
        end
        [one.values, file] = put(columns_first(values, count), file);
      end
      sent.variables{k} = one;
    end
    sent.attributes = scalars(made);
  elseif isfield(made, "columns")
    sent = struct("shape", "table", "rows", 0);
    sent.columns = {};
    for k = 1:numel(made.columns)
      one = made.columns(k);
      sent.rows = numel(one.values);
      if iscell(one.values)
        one.kind = "text";
        one.values = one.values(:)';
      else
        one.kind = "real";
        if islogical(one.values)
          one.kind = "flag";
        elseif isinteger(one.values)
          one.kind = "integer";
        end
        [one.values, file] = put(one.values(:), file);
      end
      sent.columns{k} = one;
    end
    sent.attributes = scalars(made);
  elseif isfield(made, "A")
    sent = struct("shape", "state_space", "states", rows(made.A), "inputs", columns(made.B), "outputs", rows(made.C));
    sent.sample_time_s = made.sample_time_s;
    if isfield(made, "innovation_variance")
      sent.innovation_variance = made.innovation_variance;
    end
    for name = {"A", "B", "C", "D", "K", "x0"}
      if isfield(made, name{1})
        [sent.matrices.(name{1}), file] = put(columns_first(made.(name{1}), 2), file);
      end
    end
  else
    sent = struct("shape", "document", "value", made.value);
  end
end

function attributes = scalars(made)
  attributes = struct();
  if isfield(made, "attributes")
    attributes = made.attributes;
  end
end

% A column of numbers: into the file if there is one, else into the line.
function [where, file] = put(values, file)
  if isempty(file)
    where = num2cell(double(values(:))');
    return
  end
  name = sprintf("d%d", numel(fieldnames(file.numbers)) + 1);
  if islogical(values)
    values = uint8(values);
  end
  file.numbers.(name) = values;
  where = ["/" name "/value"];
end

function write_file(file)
  numbers = file.numbers;
  if ! isempty(fieldnames(numbers))
    save("-hdf5", file.path, "-struct", "numbers");
  end
end

% ---- lines

function say(message)
  fputs(stdout, [json(message) "\n"]);
  fflush(stdout);
end

% JSON to the last digit, which jsonencode rounds away; a cell is a list, a struct array too, a number that is not
% finite is null.
function text = json(value)
  if ischar(value)
    text = quoted(value);
  elseif iscell(value)
    text = ["[" strjoin(cellfun(@json, value(:)', "UniformOutput", false), ",") "]"];
  elseif isstruct(value)
    if numel(value) != 1
      text = json(num2cell(value(:)'));
      return
    end
    names = fieldnames(value)';
    parts = cellfun(@(name) [quoted(name) ":" json(value.(name))], names, "UniformOutput", false);
    text = ["{" strjoin(parts, ",") "}"];
  elseif isempty(value)
    text = "null";
  elseif numel(value) > 1
    text = json(num2cell(value(:)'));
  elseif islogical(value)
    text = {"false", "true"}{value + 1};
  elseif isinteger(value)
    text = sprintf("%d", value);
  elseif ! isfinite(value)
    text = "null";
  else
    text = sprintf("%.17g", value);
  end
end

function text = quoted(text)
  text = strrep(text, "\\", "\\\\");
  text = strrep(text, "\"", "\\\"");
  for code = [8 9 10 12 13]
    text = strrep(text, char(code), sprintf("\\u%04x", code));
  end
  text = ["\"" text "\""];
end
